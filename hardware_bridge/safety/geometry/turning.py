"""How near a car can come to a line while it drives a way, whichever way it is steered.

The car points at an angle alpha away from the shortest way to the line and turns no tighter than
a radius r. It comes nearest when it turns towards the line as tight as it can until it points
straight at it, so that a way s brings it nearer by

    r (sin(alpha) - sin(alpha - s / r))         while s <= r alpha,
    r sin(alpha) + (s - r alpha)                beyond.

Where alpha > pi / 2 it first gets away from the line: that is no gain, but no loss either.
"""

from __future__ import annotations

import numpy as np

from tracking.arrays import F64


def gain(way: F64, angle: F64, radius: F64 | float) -> F64:
    """How much nearer a way [m] can bring a car, at most [m]; 0 where it cannot.

    Args:
        way: Not negative, (...) [m].
        angle: Between its direction of travel and the shortest way to the line, 0 to pi,
            (...) [rad].
        radius: Of its tightest turn [m].
    """
    rest = angle - way / radius
    nearer = radius * (np.sin(angle) - np.sin(np.maximum(rest, 0.0)))
    most: F64 = np.maximum(nearer + radius * np.maximum(-rest, 0.0), 0.0)
    return most


def way_within(room: F64, angle: F64, radius: F64 | float) -> F64:
    """Longest way [m] that brings a car nearer by no more than a room; the inverse of `gain`.

    Args:
        room: (...) [m]; what is below 0 counts as 0.
        angle: As for `gain`.
        radius: As for `gain`.
    """
    r, sine = np.maximum(room, 0.0), np.sin(angle)
    left = sine - r / radius
    # The angle that is left where the room is used up; there is none if it points straight there.
    rest = np.minimum(np.arcsin(np.clip(left, 0.0, 1.0)), angle)
    way: F64 = radius * (angle - rest) + np.maximum(-left, 0.0) * radius
    return way
