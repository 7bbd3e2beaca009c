"""Plan of the nodes in the axes of the world, with error ellipses and links.

Relative positions leave the translation free: the origin is the first node with the most usable
pairs. Ellipses show the position relative to the origin at three standard deviations.
"""

from __future__ import annotations

import math
from types import ModuleType
from typing import Any

import numpy as np

from agents.hardware.live.snapshot import PairRow, Snapshot
from tracking.arrays import F64

SIGMAS = 3.0
ARROW = 0.4
"""[m] Length of a heading arrow."""
CORNERS = 48
"""[-] Corners of an ellipse."""
SIGHT = (60, 180, 90)
BLOCKED = (240, 150, 30)
LOST = (220, 60, 60)
VAGUE = (130, 130, 130)
"""Colour of links without a usable estimate, and of ellipses."""
NODE = (70, 130, 230)
SILENT = (130, 130, 130)
SILENT_AFTER = 1.0
"""[s] Time without a message after which a node is drawn as silent."""
_USABLE = ("ok", "lost", "doubtful", "ambiguous")


def log_scene(rr: ModuleType, stream: Any, snapshot: Snapshot) -> None:
    """Log a snapshot at the current time of the stream."""
    places, ellipses = place(snapshot)
    active = {
        n.node: n.message_age is not None and n.message_age < SILENT_AFTER for n in snapshot.nodes
    }
    ids = [node for node in active if node in places]
    points = np.array([places[node] for node in ids]).reshape(-1, 3)
    colours = [NODE if active[node] else SILENT for node in ids]
    labels = [str(node) for node in ids]
    stream.log("plan/nodes", rr.Points3D(points, colors=colours, labels=labels, radii=0.08))
    pointing = [n for n in snapshot.nodes if n.node in places and n.heading is not None]
    arrows = [(ARROW * math.cos(n.heading or 0.0), ARROW * math.sin(n.heading or 0.0), 0.0)
              for n in pointing]  # fmt: skip
    stream.log(
        "plan/headings",
        rr.Arrows3D(
            vectors=np.array(arrows).reshape(-1, 3),
            origins=np.array([places[n.node] for n in pointing]).reshape(-1, 3),
            colors=[NODE] * len(pointing),
        ),
    )
    stream.log("plan/sigma", rr.LineStrips3D(list(ellipses.values()), colors=[VAGUE], radii=0.01))
    links = [p for p in snapshot.pairs if p.node_i in places and p.node_j in places]
    stream.log(
        "plan/links",
        rr.LineStrips3D(
            [[places[p.node_i], places[p.node_j]] for p in links],
            colors=[link_colour(p) for p in links],
            radii=0.02,
        ),
    )


def place(snapshot: Snapshot) -> tuple[dict[int, F64], dict[int, F64]]:
    """Return known positions (3) [m] and error ellipses (corner, 3) [m] by node id."""
    known = [p for p in snapshot.pairs if p.pos_w is not None and p.status in _USABLE]
    counts = {n.node: sum(n.node in (p.node_i, p.node_j) for p in known) for n in snapshot.nodes}
    if not known:
        return {}, {}
    origin = max(counts, key=lambda node: counts[node])
    places: dict[int, F64] = {origin: np.zeros(3)}
    ellipses: dict[int, F64] = {}
    for p in known:
        if origin not in (p.node_i, p.node_j) or p.pos_w is None or p.cov_w is None:
            continue
        other, sign = (p.node_j, 1.0) if p.node_i == origin else (p.node_i, -1.0)
        places[other] = sign * np.array(p.pos_w)
        ellipses[other] = places[other] + ellipse(p.cov_w)
    return places, ellipses


def ellipse(cov_w: tuple[float, float, float]) -> F64:
    """Return the error ellipse of `SIGMAS` standard deviations around 0, (corner, 3) [m].

    Args:
        cov_w: Elements xx, yy, xy of the covariance [m2].
    """
    xx, yy, xy = cov_w
    values, axes = np.linalg.eigh(np.array([[xx, xy], [xy, yy]]))
    phase = np.linspace(0.0, 2.0 * np.pi, CORNERS + 1)
    circle = np.stack([np.cos(phase), np.sin(phase)])
    line = np.zeros((CORNERS + 1, 3))
    line[:, :2] = (axes @ (SIGMAS * np.sqrt(np.maximum(values, 0.0))[:, None] * circle)).T
    return line


def link_colour(pair: PairRow) -> tuple[int, int, int]:
    """Return red for a lost or doubtful pair, grey for other unusable ones, else green to orange.

    The colour changes from green to orange with the NLOS probability.
    """
    if pair.status in ("lost", "doubtful"):
        return LOST
    if pair.status != "ok":
        return VAGUE
    share = pair.nlos_prob or 0.0
    r, g, b = (round(a + share * (c - a)) for a, c in zip(SIGHT, BLOCKED, strict=True))
    return r, g, b
