"""Path of a person: a figure of eight in the room, as a function of the distance along it.

    x = a sin(2 phi + shift),    y = b sin(phi)

Its left and right turns cancel, so the heading is periodic.
"""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline

from tracking.arrays import F64

MARGIN = 0.85
"""[m] Distance from the path to the walls; arms reach 0.8 m."""
KNOTS = 721


class Path:
    """Figure of eight of one person."""

    def __init__(self, room: tuple[float, float], rng: np.random.Generator) -> None:
        """Draw the path.

        Args:
            room: Size along x and along y [m]; the origin is the centre.
            rng: Generator of size, shape, start and sense of rotation.
        """
        a, b = np.maximum(0.5 * np.array(room) - MARGIN, 0.3) * rng.uniform(0.85, 1.0, 2)
        shift = rng.uniform(-0.25, 0.25)
        sense = 1.0 if rng.random() < 0.5 else -1.0
        phi = rng.uniform(0.0, 2.0 * np.pi) + sense * np.linspace(0.0, 2.0 * np.pi, KNOTS)
        pos = np.stack([a * np.sin(2.0 * phi + shift), b * np.sin(phi)], axis=1)
        along = sense * np.stack([2.0 * a * np.cos(2.0 * phi + shift), b * np.cos(phi)], axis=1)
        pos[-1], along[-1] = pos[0], along[0]
        heading = np.unwrap(np.arctan2(along[:, 1], along[:, 0]))
        way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(pos, axis=0), axis=1))])
        self._length = float(way[-1])
        rows = np.column_stack([pos, heading])
        rows[-1] = rows[0]
        self._spline = CubicSpline(way, rows, bc_type="periodic")

    def at(self, way: F64) -> tuple[F64, F64]:
        """Return points on the path.

        Args:
            way: Distance along the path from its start, (point) [m]; the path is periodic.

        Returns:
            Positions, (point, 2) [m], and the heading without jumps, (point) [rad].
        """
        rows = self._spline(way % self._length)
        return rows[:, :2], rows[:, 2]
