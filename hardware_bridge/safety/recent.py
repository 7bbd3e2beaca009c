"""Bounds of the cars' motion given the commands sent so far.

Estimates of speed are delayed and a car does not follow a command at once. Its speed and steering
angle are at most as large as the recent commands permit.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tracking.arrays import F64

SERVO = 2.0
"""[rad/s] Rate at which wheels turn back at least; includes delays of servo and wire."""


class Recent(NamedTuple):
    """Arrays over (env, car); all except `speed` and `steering` are non-negative."""

    speed: F64
    """Latest commanded speed, forward positive [m/s]."""
    steering: F64
    """Latest commanded steering angle, left positive [rad]."""
    forward: F64
    """Highest possible forward speed of the car [m/s]."""
    backward: F64
    """Highest possible backward speed of the car [m/s]."""
    left: F64
    """Largest possible steering angle to the left [rad]."""
    right: F64
    """Largest possible steering angle to the right [rad]."""

    def after(self, speed: F64, steering: F64, elapsed: F64, braking: float) -> Recent:
        """Return the bounds after a command.

        Args:
            speed: Commanded speed, (env, car) [m/s].
            steering: Commanded steering angle, (env, car) [rad].
            elapsed: Time since the last command, (env, 1) [s].
            braking: Deceleration that every car reaches at least [m/s2].
        """
        slower, straighter = braking * elapsed, SERVO * elapsed
        return Recent(
            speed,
            steering,
            np.maximum(self.forward - slower, np.maximum(speed, 0.0)),
            np.maximum(self.backward - slower, np.maximum(-speed, 0.0)),
            np.maximum(self.left - straighter, np.maximum(steering, 0.0)),
            np.maximum(self.right - straighter, np.maximum(-steering, 0.0)),
        )


def at_rest(shape: tuple[int, int]) -> Recent:
    """Return the bounds of cars at rest, before any command."""
    return Recent(*(np.zeros(shape) for _ in Recent._fields))
