"""Range between two antennas.

    z = |r| + noise,    dz/dr = r / |r|

with r the position of one antenna relative to the other.
"""

from __future__ import annotations

import math

from tracking.kernels.jit import small_kernel

MIN_DISTANCE = 0.01
"""[m] Least distance by which the direction is normalised."""


@small_kernel
def range_model(r0, r1, r2):
    """Predict a range [m]; derivatives by the relative position, three numbers [m]."""
    distance = math.sqrt(r0 * r0 + r1 * r1 + r2 * r2)
    inverse = 1.0 / max(distance, MIN_DISTANCE)
    return distance, r0 * inverse, r1 * inverse, r2 * inverse
