"""Animation of a drive, rendered by the browser from data: small, and without a video codec."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

_SCRIPT = """
<canvas width="1000" height="720"></canvas>
<div class="bar"><button>pause</button><select></select><input type="range" min="0" value="0">
<span></span></div>
<p class="key">Filled cars are true. Dashed outlines are the positions of the others
estimated by the tracker of the first car, with ellipses of two standard deviations.
Lines between cars: green in sight, orange behind an obstacle. Crosses mark the target formation
around the first car.</p>
<script>
(() => {
const drives = __DATA__, me = document.currentScript.parentElement;
const cv = me.querySelector("canvas"), g = cv.getContext("2d");
const at = me.querySelector("input"), play = me.querySelector("button");
const clock = me.querySelector("span"), choice = me.querySelector("select");
const colours = ["#2563eb", "#dc2626", "#059669", "#d97706", "#7c3aed", "#0891b2"];
drives.forEach((d, n) => choice.add(new Option(d[0], n)));
choice.hidden = drives.length < 2;
let D, scale;
const X = x => 360 + x * scale, Y = y => 360 - y * scale;
function car(x, y, h, fill, stroke) {
  g.save(); g.translate(X(x), Y(y)); g.rotate(-h);
  const l = D.car[0] * scale, w = D.car[1] * scale;
  g.beginPath(); g.roundRect(-l / 2, -w / 2, l, w, 4);
  if (fill) { g.fillStyle = fill; g.fill(); }
  g.lineWidth = 2; g.strokeStyle = stroke; g.stroke();
  g.beginPath(); g.moveTo(l / 2, 0); g.lineTo(l / 4, 0); g.stroke(); g.restore();
}
function draw(k) {
  g.clearRect(0, 0, cv.width, cv.height);
  g.fillStyle = "#fff"; g.strokeStyle = "#98a2b3"; g.lineWidth = 3;
  const w = D.room[0] * scale, d = D.room[1] * scale;
  g.beginPath(); g.rect(360 - w / 2, 360 - d / 2, w, d); g.fill(); g.stroke();
  g.fillStyle = "#475467";
  let b0 = k; while (!D.boxes[b0]) b0--;
  for (const box of D.boxes[b0]) { g.beginPath();
    box.forEach((p, n) => n ? g.lineTo(X(p[0]), Y(p[1])) : g.moveTo(X(p[0]), Y(p[1])));
    g.closePath(); g.fill(); }
  const P = D.pos[k], n = P.length, here = D.present[k], v = D.viewer[k];
  let pair = 0;
  for (let a = 0; a < n; a++) for (let b = a + 1; b < n; b++, pair++) {
    if (!here[a] || !here[b]) continue;
    g.beginPath(); g.moveTo(X(P[a][0]), Y(P[a][1])); g.lineTo(X(P[b][0]), Y(P[b][1]));
    g.strokeStyle = D.sight[k][pair] ? "#34d39988" : "#f59e0bcc"; g.lineWidth = 2; g.stroke(); }
  for (let a = 0; a < n; a++) {
    g.beginPath(); g.strokeStyle = colours[a % 6] + "55"; g.lineWidth = 2; let pen = false;
    for (let m = Math.max(0, k - 40); m <= k; m++) {
      if (!D.present[m][a]) { pen = false; continue; }
      const x = X(D.pos[m][a][0]), y = Y(D.pos[m][a][1]);
      pen ? g.lineTo(x, y) : g.moveTo(x, y); pen = true; }
    g.stroke(); }
  for (let a = 0; a < n; a++) if (here[a])
    car(P[a][0], P[a][1], D.heading[k][a], colours[a % 6], "#1c2430");
  for (let b = 0; b < n; b++) {
    const T = D.target[k][b], E = D.estimate[k][b], c = colours[b % 6];
    if (T) { const tx = X(P[v][0] + T[0]), ty = Y(P[v][1] + T[1]);
      g.strokeStyle = c; g.lineWidth = 2; g.beginPath();
      g.moveTo(tx - 6, ty - 6); g.lineTo(tx + 6, ty + 6); g.moveTo(tx - 6, ty + 6);
      g.lineTo(tx + 6, ty - 6); g.stroke(); }
    if (!E) continue;
    const ex = P[v][0] + E[0], ey = P[v][1] + E[1];
    g.setLineDash([5, 4]); car(ex, ey, E[5], null, c); g.setLineDash([]);
    g.beginPath(); g.ellipse(X(ex), Y(ey), 2 * E[2] * scale, 2 * E[3] * scale, -E[4], 0, 7);
    g.strokeStyle = c + "88"; g.stroke(); }
  plot(k, D.tracking, "tracking error [m]", 40, "#2563eb");
  plot(k, D.formation, "formation error [m]", 290, "#059669");
  clock.textContent = D.t[k].toFixed(1) + " s";
}
function plot(k, values, title, top, colour) {
  const left = 745, width = 240, height = 180;
  const peak = Math.max(0.5, ...values.filter(v => v !== null));
  g.fillStyle = "#1c2430"; g.font = "14px system-ui"; g.fillText(title, left, top - 8);
  g.strokeStyle = "#e4e7ec"; g.lineWidth = 1; g.strokeRect(left, top, width, height);
  g.fillStyle = "#667085"; g.font = "12px system-ui";
  g.fillText(peak.toFixed(1), left + 4, top + 14);
  g.beginPath(); g.strokeStyle = colour; g.lineWidth = 1.6; let pen = false;
  for (let m = 0; m <= k; m++) { const v = values[m];
    if (v === null) { pen = false; continue; }
    const x = left + width * m / (values.length - 1), y = top + height * (1 - v / peak);
    pen ? g.lineTo(x, y) : g.moveTo(x, y); pen = true; }
  g.stroke();
  const now = values[k];
  if (now !== null) { g.fillStyle = colour; g.font = "bold 16px system-ui";
    g.fillText(now.toFixed(2) + " m", left + width - 66, top + 20); }
}
let k = 0, running = __RUNNING__, last = 0;
function show(n) {
  D = drives[n][1]; at.max = D.t.length - 1;
  scale = Math.min(680 / D.room[1], 680 / D.room[0]);
  k = Math.min(k, D.t.length - 1); at.value = k; draw(k); }
function run(on) { running = on; play.textContent = on ? "pause" : "play"; }
function tick(stamp) {
  if (running && stamp - last > 1000 * D.dt) { last = stamp; k = (k + 1) % D.t.length;
    at.value = k; draw(k); }
  requestAnimationFrame(tick);
}
at.oninput = () => { k = +at.value; draw(k); };
play.onclick = () => run(!running);
choice.onchange = () => show(+choice.value);
if (location.hash) k = Number(location.hash.slice(1)) || 0;
show(0); run(running && !location.hash);
requestAnimationFrame(tick);
})();
</script>
"""


def animation_markup(frames: dict[str, Any]) -> str:
    """Return the markup of a player of one drive.

    Args:
        frames: Room, car size, dt, and lists over frames; see
            `agents.simulation.frames.FrameRecorder`.
    """
    return player_markup({"": frames})


def player_markup(drives: Mapping[str, dict[str, Any]], *, running: bool = True) -> str:
    """Return the markup of a player, with a selection list if there are several drives.

    Args:
        drives: Frames by title; see `animation_markup`.
        running: True to start playing on load.
    """
    # "</" in a title would end the script element.
    data = json.dumps(list(drives.items()), separators=(",", ":")).replace("</", "<\\/")
    return _SCRIPT.replace("__RUNNING__", json.dumps(running)).replace("__DATA__", data)
