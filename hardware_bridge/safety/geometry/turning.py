"""Closest approach of a car to a line within a path length, for any steering.

The car's direction is at an angle alpha to the shortest path to the line, and its turning radius is
at least r. The closest approach is a turn towards the line with radius r until the car points
straight at the line, so that a path of length s reduces the distance by

    r (sin(alpha) - sin(alpha - s / r))         while s <= r alpha,
    r sin(alpha) + (s - r alpha)                beyond.

For alpha > pi / 2 the car first moves away from the line: this counts as neither gain nor loss.
"""

from __future__ import annotations

import numpy as np

from tracking.arrays import F64


def gain(way: F64, angle: F64, radius: F64 | float) -> F64:
    """Return the largest reduction of the distance [m] by a path; at least 0.

    Args:
        way: Path length, not negative, (...) [m].
        angle: Angle between the direction of travel and the shortest path to the line, 0 to pi,
            (...) [rad].
        radius: Radius of the tightest turn [m].
    """
    rest = angle - way / radius
    nearer = radius * (np.sin(angle) - np.sin(np.maximum(rest, 0.0)))
    most: F64 = np.maximum(nearer + radius * np.maximum(-rest, 0.0), 0.0)
    return most


def way_within(room: F64, angle: F64, radius: F64 | float) -> F64:
    """Return the longest path [m] that uses up at most a clearance; the inverse of `gain`.

    Args:
        room: Clearance, (...) [m]; negative values count as 0.
        angle: As for `gain`.
        radius: As for `gain`.
    """
    r, sine = np.maximum(room, 0.0), np.sin(angle)
    left = sine - r / radius
    # The remaining angle when the clearance is used up; 0 if the car points straight at the line.
    rest = np.minimum(np.arcsin(np.clip(left, 0.0, 1.0)), angle)
    way: F64 = radius * (angle - rest) + np.maximum(-left, 0.0) * radius
    return way
