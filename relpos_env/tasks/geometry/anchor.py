"""Collision-free placement of a stationary formation among obstacles."""

from __future__ import annotations

import numpy as np

from relpos_env.scenarios.rooms.overlap import distance
from tracking.arrays import F64

CLEAR = 0.3
"""[m] Minimum distance of slots from obstacles; equal to `moving.MARGIN`, that from walls."""
STEP = 0.1
"""[m] Grid spacing of the candidate anchors."""


def free_anchor(requested: F64, half: F64, places: F64, boxes: F64) -> F64:
    """Return the anchor nearest to a requested one with all slots at least `CLEAR` from boxes.

    If there is none, return the candidate with the largest clearance.

    Args:
        requested: Requested middle of the formation, (2) [m].
        half: Maximum distance from the room's middle along x and y, (2) [m].
        places: Slots relative to the middle, in the world's axes, (slot, 2) [m].
        boxes: Boxes in the room, (box, 6); boxes of zero size are ignored.

    Returns:
        Anchor, (2) [m].
    """
    boxes = boxes[boxes[:, 2] > 0.0]
    requested = np.clip(requested, -half, half)
    if _clearance(requested[None], places, boxes)[0] >= CLEAR:
        return requested  # the usual case in large rooms, where the search is slow
    axes = [np.linspace(-h, h, 2 * int(np.ceil(h / STEP)) + 1) for h in half]
    tried = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    clear = _clearance(tried, places, boxes)
    free = np.flatnonzero(clear >= CLEAR)
    if not len(free):
        free = np.array([np.argmax(clear)])
    nearest: F64 = tried[free[np.argmin(np.linalg.norm(tried[free] - requested, axis=1))]]
    return nearest


def _clearance(anchors: F64, places: F64, boxes: F64) -> F64:
    """Return the smallest distance of slots from boxes, (anchor) [m]; infinite without boxes."""
    clear = np.full(len(anchors), np.inf)
    for box in boxes:
        clear = np.minimum(clear, distance(anchors[:, None] + places, box).min(axis=1))
    return clear
