"""Mean velocity of a group: a pseudo-measurement of 0 with a large noise.

0 = (1 / m) sum v_i + noise
"""

from __future__ import annotations

from tracking.kernels.jit import small_kernel


@small_kernel
def mean_velocity_model(v, m):
    """Predict the part of one of m nodes in the mean velocity [m/s]; derivative by its velocity."""
    return v / m, 1.0 / m
