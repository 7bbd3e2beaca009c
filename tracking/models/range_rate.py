"""Rate of a range.

    z = u . v + noise,    u = r / |r|

with r the position and v the velocity of one antenna relative to the other.
"""

from __future__ import annotations

from tracking.kernels.jit import small_kernel
from tracking.models.range import MIN_DISTANCE, range_model


@small_kernel
def range_rate_model(r0, r1, r2, v0, v1, v2):
    """Predict the rate of a range [m/s]; derivatives by relative position and velocity."""
    distance, u0, u1, u2 = range_model(r0, r1, r2)
    inverse = 1.0 / max(distance, MIN_DISTANCE)
    rate = u0 * v0 + u1 * v1 + u2 * v2
    d0, d1, d2 = (v0 - rate * u0) * inverse, (v1 - rate * u1) * inverse, (v2 - rate * u2) * inverse
    return rate, d0, d1, d2, u0, u1, u2
