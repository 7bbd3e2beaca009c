"""Position of a point relative to a polygon, such as the fence."""

from __future__ import annotations

import numpy as np

from tracking.arrays import F64, Bool


def to_edges(place: F64, corners: F64) -> tuple[Bool, F64]:
    """Return whether points are inside a polygon, and the offset to the nearest point of each edge.

    Args:
        place: Points, (..., 2) [m].
        corners: Corners of the polygon, (corner, 2) [m].

    Returns:
        Inside, (...); offsets to the edges, (..., corner, 2) [m].
    """
    a, b = corners, np.roll(corners, -1, axis=0)
    edge, from_a = b - a, place[..., None, :] - a
    along = np.clip((from_a * edge).sum(axis=-1) / np.maximum((edge**2).sum(axis=-1), 1e-12), 0, 1)
    offset: F64 = a + along[..., None] * edge - place[..., None, :]
    y, x = place[..., None, 1], place[..., None, 0]
    spans = (a[:, 1] > y) != (b[:, 1] > y)
    rise = np.where(edge[:, 1] == 0.0, 1.0, edge[:, 1])
    crosses = spans & (x < a[:, 0] + (y - a[:, 1]) / rise * edge[:, 0])
    inside: Bool = crosses.sum(axis=-1) % 2 == 1
    return inside, offset


def area(corners: F64) -> float:
    """Return the area of a polygon [m2]; positive for counter-clockwise corners."""
    (x, y), (u, v) = corners.T, np.roll(corners, -1, axis=0).T
    return float(0.5 * (x * v - u * y).sum())


def outwards(corners: F64) -> F64:
    """Return the outward unit normals of the edges of a polygon, (corner, 2)."""
    edge = np.roll(corners, -1, axis=0) - corners
    length = np.maximum(np.hypot(edge[:, 0], edge[:, 1]), 1e-9)
    right = np.stack([edge[:, 1], -edge[:, 0]], axis=-1) / length[:, None]
    normal: F64 = right * np.sign(area(corners))
    return normal
