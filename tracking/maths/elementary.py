"""Elementary functions for operations at every range, without a call of the C library.

A call spills all registers, which takes longer here than its computation.
"""

from __future__ import annotations

import math

import numpy as np

from tracking.kernels.jit import small_kernel

SERIES = 0.25**2
"""[rad2] Squared angle below which the Taylor series with these terms is exact to rounding."""
C1, C2, C3, C4, C5, C6 = ((-1) ** k / math.factorial(2 * k) for k in range(1, 7))
S1, S2, S3, S4, S5, S6 = ((-1) ** k / math.factorial(2 * k + 1) for k in range(1, 7))


@small_kernel
def small_turn(square):
    """Return the cosine of an angle and its sine over the angle by Taylor series in its square."""
    x = square
    sine = S1 + x * (S2 + x * (S3 + x * (S4 + x * (S5 + x * S6))))
    cosine = C1 + x * (C2 + x * (C3 + x * (C4 + x * (C5 + x * C6))))
    return 1.0 + x * cosine, 1.0 + x * sine


@small_kernel
def cosine_sine(angle):
    """Return cosine and sine of any angle [rad]; fast for small ones."""
    square = angle * angle
    if square < SERIES:
        cosine, sine = small_turn(square)
        return cosine, sine * angle
    return math.cos(angle), math.sin(angle)


@small_kernel
def turn(cosine, sine, a, b):
    """Rotate a vector (a, b) in the plane by an angle, given its cosine and sine."""
    return cosine * a - sine * b, sine * a + cosine * b


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
