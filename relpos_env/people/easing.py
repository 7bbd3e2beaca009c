"""Smooth transitions between values: speed and acceleration have no steps.

The ramp is the quintic 10 x^3 - 15 x^4 + 6 x^5, the minimum-jerk path between two rests [1].

References:
    [1] Flash, Hogan, The coordination of arm movements, J. Neuroscience 5 (1985) 1688.
"""

from __future__ import annotations

import numpy as np

from tracking.arrays import F64


def ease(x: F64) -> F64:
    """Return a ramp from 0 at x = 0 to 1 at x = 1, constant outside."""
    x = np.clip(x, 0.0, 1.0)
    return np.asarray(x**3 * (10.0 - 15.0 * x + 6.0 * x**2))


def ease_integral(x: F64) -> F64:
    """Return the integral of `ease` from 0 to x."""
    inside = np.clip(x, 0.0, 1.0)
    within = inside**4 * (2.5 - 3.0 * inside + inside**2)
    return np.asarray(within + np.maximum(x - 1.0, 0.0))


def bump(x: F64) -> F64:
    """Return a bump from 0 at x = 0 to 1 at x = 1/2 and back to 0 at x = 1, constant outside."""
    x = np.clip(x, 0.0, 1.0)
    return np.asarray(64.0 * x**3 * (1.0 - x) ** 3)


def window(t: F64, seconds: float, ramp: float) -> F64:
    """Return a window of 1 from 0 to `seconds`, with ramps inside at both ends."""
    return ease(t / ramp) * ease((seconds - t) / ramp)


def join(
    t: F64, seconds: float, begin: tuple[float, float, float], end: tuple[float, float, float]
) -> F64:
    """Return the quintic from one state to another.

    Args:
        t: Times since the first state, (time) [s].
        seconds: Time of the second state [s].
        begin: Value, speed and acceleration of the first state.
        end: Value, speed and acceleration of the second state.
    """
    x, h = t / seconds, seconds
    p0, v0, a0 = begin[0], begin[1] * h, begin[2] * h * h
    p1, v1, a1 = end[0], end[1] * h, end[2] * h * h
    c3 = 10.0 * (p1 - p0) - 6.0 * v0 - 4.0 * v1 - 1.5 * a0 + 0.5 * a1
    c4 = -15.0 * (p1 - p0) + 8.0 * v0 + 7.0 * v1 + 1.5 * a0 - a1
    c5 = 6.0 * (p1 - p0) - 3.0 * (v0 + v1) - 0.5 * a0 + 0.5 * a1
    return np.asarray(p0 + x * (v0 + x * (0.5 * a0 + x * (c3 + x * (c4 + x * c5)))))
