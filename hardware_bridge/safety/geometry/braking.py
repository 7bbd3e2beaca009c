"""How fast a car may be that must stop within a distance.

From a speed v it comes to rest after the way v T + v^2 / (2 a), with the reaction time T and the
deceleration a that it surely has.
"""

from __future__ import annotations

import numpy as np

from tracking.arrays import F64


def stopping_way(speed: F64, reaction: F64 | float, braking: float) -> F64:
    """Way to a stop [m] from a speed [m/s], which is taken for 0 where it is below."""
    v = np.maximum(speed, 0.0)
    way: F64 = v * reaction + v * v / (2.0 * braking)
    return way


def stopping_speed(way: F64, reaction: F64 | float, braking: float) -> F64:
    """Largest speed [m/s] that comes to a stop within a way [m]; 0 where there is none."""
    s = np.maximum(way, 0.0)
    lag = braking * reaction
    speed: F64 = np.sqrt(lag * lag + 2.0 * braking * s) - lag
    return speed
