"""Where the beams of a car's distance sensors stand, for who measures and for who reads them.

Evenly round the car, the first straight ahead, counter-clockwise. A beam starts where the ray from
the middle of the car leaves its body, so that 0 is a touch.
"""

from __future__ import annotations

from math import pi

import numpy as np

from tracking.arrays import F64

MOST_BEAMS = 32
"""[-] Round a car."""
FARTHEST = 3.0
"""[m] No beam reaches farther, and observations have room for no more."""


def beam_directions(n_beams: int) -> F64:
    """Where beams point in the frame of the car, forward and left, (beam, 2)."""
    angles = 2.0 * pi * np.arange(n_beams) / max(n_beams, 1)
    directions: F64 = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    return directions


def beam_starts(directions: F64, half_length: float, half_width: float) -> F64:
    """From the middle of a car to where its beams start, (beam) [m].

    Args:
        directions: (beam, 2)
        half_length: Of the car [m].
        half_width: Of the car [m].
    """
    along, across = np.abs(directions).T
    starts: F64 = np.minimum(
        half_length / np.maximum(along, 1e-12), half_width / np.maximum(across, 1e-12)
    )
    return starts
