"""Draw the animations of docs/reference/gallery.md: every task, every scenario, people.

Run `python benchmarks/draw_gallery.py [NAME ...]`; all take about six minutes and need pygame.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageSequence

from agents.evaluation.track import track_log
from agents.simulation.simulate import simulate
from relpos_env.scenarios import PEOPLE, SCENARIOS
from relpos_env.tasks import TASKS
from tracking.arrays import F64, I64

OUT = Path(__file__).resolve().parents[1] / "docs" / "images" / "gallery"
SECONDS, SEED = 20.0, 2
ROOM = 0.692
"""[-] Share of the room in the width of a frame; the rest is the legend."""
WIDTH = 280
"""[px] Width of an animation."""
HIP, VIEW = 2, 2.4
"""Tracker on the hip; [m] width of the picture of a person."""
EVERY = 4
"""[-] Every fourth frame is kept."""


def shrink(source: Path, target: Path) -> None:
    """Write a small copy of a drive without its legend."""
    with Image.open(source) as gif:
        frames = []
        for k, frame in enumerate(ImageSequence.Iterator(gif)):
            if k % EVERY == 0:
                width, height = round(frame.width * ROOM), frame.height
                small = frame.convert("RGB").crop((0, 0, width, height))
                frames.append(
                    small.resize((WIDTH, round(WIDTH * height / width)), Image.Resampling.LANCZOS)
                )
                frames[-1] = frames[-1].quantize(64, method=Image.Quantize.FASTOCTREE)
        duration = EVERY * int(gif.info.get("duration", 200))
    frames[0].save(target, save_all=True, append_images=frames[1:], duration=duration, loop=0)


def draw_people(name: str) -> None:
    """Write an animation of a tracked person, seen along y, relative to the tracker on the hip."""
    log = simulate(scenario=name, seconds=2.0 * SECONDS, seed=SEED)
    result, pairs = track_log(log, findings=[]), log.constellation.pairs
    frames = []
    for k in range(len(result.estimate.t) // 2, len(result.estimate.t), EVERY):
        picture = Image.new("RGB", (WIDTH, WIDTH), "white")
        draw = ImageDraw.Draw(picture)
        estimated, true = (
            WIDTH * (relative_to(pos[k], pairs, HIP)[:, [0, 2]] * [1.0, -1.0] / VIEW + 0.5)
            for pos in (result.estimate.pos_ij_w, result.truth_ij_w)
        )
        for a, b in zip(estimated, true, strict=True):
            draw.line((*a, *b), fill="#b0b0b0", width=2)
        for dots, colour, radius in ((estimated, "#e8a070", 7), (true, "#303030", 4)):
            for dot in dots:
                draw.ellipse((*(dot - radius), *(dot + radius)), fill=colour)
        frames.append(picture.quantize(16, method=Image.Quantize.FASTOCTREE))
    frames[0].save(
        OUT / f"{name}.gif", save_all=True, append_images=frames[1:], duration=50 * EVERY, loop=0
    )


def relative_to(pos: F64, pairs: I64, node: int) -> F64:
    """Return positions of all nodes relative to one, (node, 3) [m], from those of pairs."""
    out = np.zeros((pairs.max() + 1, 3))
    for p, (i, j) in enumerate(pairs):
        if i == node:
            out[j] = pos[p]
        elif j == node:
            out[i] = -pos[p]
    return out


def main() -> None:
    """Run the demonstrations and write their animations, all or those named."""
    OUT.mkdir(parents=True, exist_ok=True)
    chosen = set(sys.argv[1:])
    for name in PEOPLE:
        if not chosen or name in chosen:
            draw_people(name)
    with tempfile.TemporaryDirectory() as scratch:
        jobs = [(f"task-{name}", ["--task", name]) for name in TASKS]
        for name in SCENARIOS:
            task = "gap" if name == "gap" else "hold"
            jobs.append((name, ["--scenario", name, "--task", task]))
        for name, how in jobs:
            if chosen and name not in chosen:
                continue
            folder = Path(scratch) / name
            command = [sys.executable, "-m", "agents.cli.main", "demo", "--gif", "--out", folder]
            times = ["--seconds", str(SECONDS), "--seed", str(SEED)]
            subprocess.run([*map(str, command), *times, *how], check=True, capture_output=True)
            shrink(folder / "drive.gif", OUT / f"{name}.gif")
            print(name, file=sys.stderr)


if __name__ == "__main__":
    main()
