"""Relative speed, as the text of Armani and Holz writes the second measurement of a pair.

z = |v| + noise,    dz/dv = v / |v|
"""

from __future__ import annotations

import math

from tracking.kernels.jit import small_kernel

MIN_SPEED = 1e-6
"""[m/s] A slower velocity has no direction."""


@small_kernel
def relative_speed_model(v0, v1, v2):
    """Predict the relative speed [m/s]; derivatives by the relative velocity, three numbers."""
    speed = math.sqrt(v0 * v0 + v1 * v1 + v2 * v2)
    inverse = 1.0 / max(speed, MIN_SPEED)
    return speed, v0 * inverse, v1 * inverse, v2 * inverse
