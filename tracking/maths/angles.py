"""Rotations by angles that are nearly always small, without a call of the C library."""

from __future__ import annotations

import math

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
