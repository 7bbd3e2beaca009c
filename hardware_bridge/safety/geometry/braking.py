"""Highest speed from which a car stops within a distance.

From a speed v a car stops within v T + v^2 / (2 a), with the reaction time T and the guaranteed
deceleration a.
"""

from __future__ import annotations

import numpy as np

from tracking.arrays import F64


def stopping_way(speed: F64, reaction: F64 | float, braking: float) -> F64:
    """Return the stopping distance [m] from a speed [m/s]; negative speeds count as 0."""
    v = np.maximum(speed, 0.0)
    way: F64 = v * reaction + v * v / (2.0 * braking)
    return way


def stopping_speed(way: F64, reaction: F64 | float, braking: float) -> F64:
    """Return the highest speed [m/s] that stops within a distance [m]; 0 for negative distances."""
    s = np.maximum(way, 0.0)
    lag = braking * reaction
    speed: F64 = np.sqrt(lag * lag + 2.0 * braking * s) - lag
    return speed
