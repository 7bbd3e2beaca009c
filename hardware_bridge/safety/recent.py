"""What cars may still be doing because of what they were told a moment ago.

Estimates of speed are old and a car does not follow a command at once. What was sent is known at
once: a car is at most as fast, and its wheels at most as far turned, as it was told lately.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tracking.arrays import F64

SERVO = 2.0
"""[rad/s] Wheels surely turn back so fast; delays of servo and wire are in it."""


class Recent(NamedTuple):
    """All arrays over (env, car); but for the first two, none negative."""

    speed: F64
    """Speed that was sent last, forward positive [m/s]."""
    steering: F64
    """Steering angle that was sent last, left positive [rad]."""
    forward: F64
    """Fastest that the car may still be, for what was sent [m/s]."""
    backward: F64
    """Fastest that the car may still be backwards [m/s]."""
    left: F64
    """Furthest that its wheels may still be turned to the left [rad]."""
    right: F64
    """Furthest that its wheels may still be turned to the right [rad]."""

    def after(self, speed: F64, steering: F64, elapsed: F64, braking: float) -> Recent:
        """What may be after a command.

        Args:
            speed: Speed that is sent, (env, car) [m/s].
            steering: Steering angle that is sent, (env, car) [rad].
            elapsed: Since the last command, (env, 1) [s].
            braking: What cars surely brake with [m/s2].
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
    """Nothing was sent yet."""
    return Recent(*(np.zeros(shape) for _ in Recent._fields))
