"""Zero velocity of a node at rest (ZUPT), one axis at a time.

0 = v + noise
"""

from __future__ import annotations

from tracking.kernels.jit import small_kernel


@small_kernel
def zero_velocity_model(v):
    """Predict a component of the velocity [m/s]; derivative by it. The measurement is 0."""
    return v, 1.0
