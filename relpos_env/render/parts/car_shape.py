"""Outline of a car and its parts in top view, for a car of length and width 1.

x forward, y left, origin in the middle. Both axes are scaled to the size of the car.
"""

from __future__ import annotations

import numpy as np

from tracking.arrays import F64


def _rounded(corners: list[tuple[float, float]], radii: tuple[float, float]) -> F64:
    """Return a convex outline with its corners rounded by quadratic arcs, (point, 2).

    ``radii`` are the lengths cut from the sides, relative to length and width.
    """
    ring = np.array(corners)
    points = []
    for k, corner in enumerate(ring):
        ends = []
        for side in (ring[k - 1] - corner, ring[(k + 1) % len(ring)] - corner):
            reach = min(1.0 / np.max(np.abs(side) / radii), 0.5)
            ends.append(corner + reach * side)
        for u in np.linspace(0.0, 1.0, 6):
            points.append((1 - u) ** 2 * ends[0] + 2 * u * (1 - u) * corner + u**2 * ends[1])
    return np.array(points)


BODY = _rounded([(0.5, 0.35), (0.5, -0.35), (-0.5, -0.43), (-0.5, 0.43)], (0.14, 0.24))
ROOF = _rounded([(0.10, 0.30), (0.10, -0.30), (-0.30, -0.33), (-0.30, 0.33)], (0.05, 0.10))
WINDSCREEN = np.array([(0.11, 0.29), (0.11, -0.29), (0.25, -0.34), (0.25, 0.34)])
REAR_WINDOW = np.array([(-0.31, 0.31), (-0.31, -0.31), (-0.39, -0.34), (-0.39, 0.34)])
LAMPS = (
    np.array([(0.40, 0.33), (0.40, 0.19), (0.47, 0.19), (0.465, 0.30)]),
    np.array([(0.40, -0.33), (0.40, -0.19), (0.47, -0.19), (0.465, -0.30)]),
)
TYRE = _rounded([(0.105, 0.085), (0.105, -0.085), (-0.105, -0.085), (-0.105, 0.085)], (0.03, 0.05))
FRONT_WHEELS = np.array([(0.31, 0.42), (0.31, -0.42)])
REAR_WHEELS = np.array([(-0.31, 0.42), (-0.31, -0.42)])
