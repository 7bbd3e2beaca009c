"""Exponentials for operations at every range, without a call of the C library.

A call spills all registers, which takes longer here than its computation.
"""

from __future__ import annotations

import math

import numpy as np

from tracking.kernels.jit import small_kernel

LEAST = -745.0
"""[-] Smallest argument of an exponential: the result is the smallest positive number."""
MOST = 10.0
"""[-] Largest argument of an exponential."""
LARGEST = 2.0**15
POWERS = LARGEST * 0.5 ** np.arange(1100)
"""Powers of two in descending order, from `LARGEST` on."""
PER_LOG2, LOG2 = 1.0 / math.log(2.0), math.log(2.0)


@small_kernel
def exponential(x):
    """Return ``exp(x)`` of numbers up to 10, to a few parts in 1e12.

    A power of two is multiplied by the fourth diagonal Pade approximant of the remainder.
    """
    x = min(x if x > LEAST else LEAST, MOST)  # NaN becomes LEAST, as it selects an index below
    n = math.floor(x * PER_LOG2 + 0.5)
    y = x - n * LOG2
    square = y * y
    even, odd = 1680.0 + square * (180.0 + square), y * (840.0 + 20.0 * square)
    return POWERS[np.uint64(15 - int(n))] * ((even + odd) / (even - odd))


@small_kernel
def likelihood(off, variance):
    """Return the density of a Gaussian at `off` from its mean, times the root of two pi."""
    return exponential(-0.5 * off * off / variance) / math.sqrt(variance)


@small_kernel
def decay(ratio):
    """Return ``exp(-ratio)`` to second order: between 0 and 1 for any ratio above 0."""
    return 1.0 / (1.0 + ratio * (1.0 + 0.5 * ratio))
