"""Lasting error of a range: a fast and a slow part, first-order Markov over the distance travelled.

    z = e_fast + e_slow,    dz/de = 1
    e <- k e + (1 - k) m,    k = exp(-s / length),    P <- k^2 P + (1 - k^2) var

with s the distance that both ends have travelled meanwhile, and m and var the mean and variance
that e tends to: m is 0 in LOS and the NLOS bias in NLOS (`nlos`).
"""

from __future__ import annotations

from tracking.kernels.jit import small_kernel


@small_kernel
def range_bias_model(fast, slow):
    """Predict the lasting error of a range [m]; derivatives by its two parts."""
    return fast + slow, 1.0, 1.0


@small_kernel
def slow_error_var(slow_var, nlos_prob, bias, bias_var):
    """Return the variance of the mixture of a slow error with and without an NLOS bias [m2]."""
    return slow_var + nlos_prob * bias_var + nlos_prob * (1.0 - nlos_prob) * bias * bias
