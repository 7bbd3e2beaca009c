"""Overlap of boxes by the separating axis theorem, and distances of points from boxes.

A box is a row of six: centre x y, half width, half depth [m], cosine and sine of its angle.
"""

from __future__ import annotations

import numpy as np

from relpos_env.world.car import CarParams
from tracking.arrays import F64, Bool

SKIN = 0.03
"""[m] Margin on every side of a car: the rounded corners of bodies and of walls."""


def car_boxes(poses: F64, car: CarParams, margin: float = SKIN) -> F64:
    """Return the boxes of cars, (car, 6).

    Args:
        poses: x, y, heading, (car, 3) [m, m, rad].
        car: Parameters with the size of the cars.
        margin: Margin added on every side [m].
    """
    half = np.array([0.5 * car.length + margin, 0.5 * car.width + margin])
    turn = np.stack([np.cos(poses[:, 2]), np.sin(poses[:, 2])], axis=1)
    return np.hstack([poses[:, :2], np.broadcast_to(half, (len(poses), 2)), turn])


def overlap(a: F64, b: F64) -> Bool:
    """Return whether each of the boxes (n, 6) overlaps each of the boxes (m, 6), (n, m).

    Two boxes are separate if and only if their projections on one of their normals are; touching
    boxes do not overlap.
    """
    apart = np.zeros((len(a), len(b)), dtype=bool)
    offset = b[None, :, :2] - a[:, None, :2]
    # Cosine and sine of the angle between the two boxes.
    c = np.abs(a[:, None, 4] * b[None, :, 4] + a[:, None, 5] * b[None, :, 5])
    s = np.abs(a[:, None, 4] * b[None, :, 5] - a[:, None, 5] * b[None, :, 4])
    for own, other, turn in ((a[:, None], b[None], a[:, None]), (b[None], a[:, None], b[None])):
        along = np.abs(turn[..., 4] * offset[..., 0] + turn[..., 5] * offset[..., 1])
        across = np.abs(-turn[..., 5] * offset[..., 0] + turn[..., 4] * offset[..., 1])
        apart |= along >= own[..., 2] + other[..., 2] * c + other[..., 3] * s
        apart |= across >= own[..., 3] + other[..., 2] * s + other[..., 3] * c
    return ~apart


def beyond_walls(boxes: F64, room: tuple[float, float]) -> Bool:
    """Return whether boxes extend beyond a room centred at the origin, (box)."""
    c, s = np.abs(boxes[:, 4]), np.abs(boxes[:, 5])
    x = np.abs(boxes[:, 0]) + boxes[:, 2] * c + boxes[:, 3] * s
    y = np.abs(boxes[:, 1]) + boxes[:, 2] * s + boxes[:, 3] * c
    out: Bool = (x > 0.5 * room[0]) | (y > 0.5 * room[1])
    return out


def distance(points: F64, box: F64) -> F64:
    """Return the distances of points (..., 2) from a box (6), 0 inside, (...) [m]."""
    offset = points - box[:2]
    along = np.abs(box[4] * offset[..., 0] + box[5] * offset[..., 1]) - box[2]
    across = np.abs(-box[5] * offset[..., 0] + box[4] * offset[..., 1]) - box[3]
    out: F64 = np.hypot(np.maximum(along, 0.0), np.maximum(across, 0.0))
    return out
