"""Mean velocity of a group: that of things that are carried, 0 with a wide noise.

0 = (1 / m) sum v_i + noise
"""

from __future__ import annotations

from tracking.kernels.jit import small_kernel


@small_kernel
def mean_velocity_model(v, m):
    """Predict what one of m nodes adds to the mean velocity [m/s]; derivative by its velocity."""
    return v / m, 1.0 / m
