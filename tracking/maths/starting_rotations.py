"""Rotations and mirror images of the first hypotheses, if the right one is unknown."""

from __future__ import annotations

import numpy as np

from tracking.arrays import F64


def starting_rotations(dimensions: int, n_planar: int) -> F64:
    """Return rotations and their mirror images that cover all rotations, (hyp, 3, 3).

    In the plane they are evenly spaced; in space they are the 24 rotations of a cube, and every
    rotation is within 63 degrees of one of them.
    """
    if dimensions == 2:
        angles = 2.0 * np.pi * np.arange(n_planar) / n_planar
        turns = np.zeros((n_planar, 3, 3))
        turns[:, 0, 0] = turns[:, 1, 1] = np.cos(angles)
        turns[:, 1, 0] = np.sin(angles)
        turns[:, 0, 1] = -np.sin(angles)
        turns[:, 2, 2] = 1.0
        mirror = np.diag([1.0, -1.0, 1.0])
    else:
        signed = [
            np.eye(3)[list(order)] * np.array(signs)[:, None]
            for order in ((0, 1, 2), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0))
            for signs in np.array(np.meshgrid([1, -1], [1, -1], [1, -1])).reshape(3, 8).T
        ]
        turns = np.array([R for R in signed if np.linalg.det(R) > 0.0])
        mirror = np.diag([1.0, 1.0, -1.0])
    return np.ascontiguousarray(np.concatenate([turns, turns @ mirror]))
