"""Where a formation can stand: no car is asked for a place that an obstacle takes."""

from __future__ import annotations

import numpy as np

from relpos_env.scenarios.rooms.overlap import distance
from tracking.arrays import F64

CLEAR = 0.3
"""[m] From a place to the obstacles nearest to it: as from walls, see `moving.MARGIN`."""
STEP = 0.1
"""[m] Between the points that are tried."""


def free_anchor(wanted: F64, half: F64, places: F64, boxes: F64) -> F64:
    """The point nearest to where a formation is wanted from which all its places are clear.

    Where there is none, the one whose places are clearest.

    Args:
        wanted: Where its middle would be, (2) [m].
        half: How far from the room's middle it may be, along x and y, (2) [m].
        places: From its middle, turned as it will stand, (place, 2) [m].
        boxes: What stands in the room, (box, 6); those of no size are not there.

    Returns:
        (2) [m]
    """
    boxes = boxes[boxes[:, 2] > 0.0]
    wanted = np.clip(wanted, -half, half)
    if _clearance(wanted[None], places, boxes)[0] >= CLEAR:
        return wanted  # as nearly always in large rooms, where there is much to try
    axes = [np.linspace(-h, h, 2 * int(np.ceil(h / STEP)) + 1) for h in half]
    tried = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    clear = _clearance(tried, places, boxes)
    free = np.flatnonzero(clear >= CLEAR)
    if not len(free):
        free = np.array([np.argmax(clear)])
    nearest: F64 = tried[free[np.argmin(np.linalg.norm(tried[free] - wanted, axis=1))]]
    return nearest


def _clearance(anchors: F64, places: F64, boxes: F64) -> F64:
    """How far the place nearest to a box is from it, (anchor) [m]; infinite without boxes."""
    clear = np.full(len(anchors), np.inf)
    for box in boxes:
        clear = np.minimum(clear, distance(anchors[:, None] + places, box).min(axis=1))
    return clear
