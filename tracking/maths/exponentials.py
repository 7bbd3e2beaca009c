"""Exponentials for what happens at every range, without a call of the C library.

A call empties all registers, which takes longer here than what it computes.
"""

from __future__ import annotations

import math

import numpy as np

from tracking.kernels.jit import small_kernel

LEAST = -745.0
"""[-] Exponentials of less are taken for that of this, the smallest number there is."""
MOST = 10.0
"""[-] And of more for that of this."""
LARGEST = 2.0**15
POWERS = LARGEST * 0.5 ** np.arange(1100)
"""Powers of two, downwards from the largest."""
PER_LOG2, LOG2 = 1.0 / math.log(2.0), math.log(2.0)


@small_kernel
def exponential(x):
    """``exp(x)`` of numbers up to 10, to a few parts in 1e12.

    A power of two times the exponential of what is left, by its fourth diagonal Pade approximant.
    """
    x = min(x if x > LEAST else LEAST, MOST)  # also of what is no number: it chooses a place below
    n = math.floor(x * PER_LOG2 + 0.5)
    y = x - n * LOG2
    square = y * y
    even, odd = 1680.0 + square * (180.0 + square), y * (840.0 + 20.0 * square)
    return POWERS[np.uint64(15 - int(n))] * ((even + odd) / (even - odd))


@small_kernel
def likelihood(off, variance):
    """Of a Gaussian, but for the root of two pi."""
    return exponential(-0.5 * off * off / variance) / math.sqrt(variance)


@small_kernel
def decay(ratio):
    """``exp(-ratio)``, to second order: between 0 and 1 for any ratio above 0."""
    return 1.0 / (1.0 + ratio * (1.0 + 0.5 * ratio))
