"""Geometry of a car's distance sensors, for simulation and observations.

The rays are evenly spaced round the car, counter-clockwise from straight ahead. A ray from the
middle of the car is measured from the edge of the body, so a reading of 0 is a contact.
"""

from __future__ import annotations

from math import pi

import numpy as np

from tracking.arrays import F64

MAX_RANGEFINDERS = 32
"""[-] Maximum number of distance sensors per car."""
FARTHEST = 3.0
"""[m] Maximum range of distance sensors, and limit of their observations."""


def rangefinder_directions(n_rangefinders: int) -> F64:
    """Return the ray directions in the body frame, forward and left, (ray, 2)."""
    angles = 2.0 * pi * np.arange(n_rangefinders) / max(n_rangefinders, 1)
    directions: F64 = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    return directions


def rangefinder_origins(directions: F64, half_length: float, half_width: float) -> F64:
    """Return the distances from the middle of a car to the edge of its body, (ray) [m].

    Args:
        directions: Unit vectors of the rays, (ray, 2).
        half_length: Half length of the car [m].
        half_width: Half width of the car [m].
    """
    along, across = np.abs(directions).T
    starts: F64 = np.minimum(
        half_length / np.maximum(along, 1e-12), half_width / np.maximum(across, 1e-12)
    )
    return starts
