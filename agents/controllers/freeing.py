"""Recovery of cars blocked by obstacles, which cannot be perceived without distance sensors.

A car counts as blocked if it has a command, is at rest despite a requested speed, and its wheels
have the requested angle; the wheels of a car that has just started are still straight. It backs out
with its wheels at full lock on the same side, which turns the bow away from the obstacle, until it
reaches a given speed. Its speed and its steering angle identify the manoeuvre, which needs no
memory. It then tries again from another pose.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from agents.controllers.base import Plane, Sight, length
from relpos_env.interface.actions import MAX_STEERING


@dataclass(frozen=True, slots=True, kw_only=True)
class FreeingParams:
    """Parameters of the recovery of blocked cars."""

    speed: float = 1.0
    """[m/s] Commanded speed; backing out ends at 0.7 of it. Larger moves farther; 0 disables."""
    sent: float = 0.5
    """[m/s] Minimum command of the operator for a recovery."""
    still: float = 0.02
    """[m/s] Speed below which a car is at rest. Larger detects more obstacles, also false ones."""
    wants: float = 0.15
    """[m/s] Minimum requested speed that counts as an attempt to move."""


def back_out(sight: Sight, else_do: Plane, params: FreeingParams) -> Plane:
    """Return speed [m/s] and steering angle [rad] with the recovery of blocked cars, each (...).

    Args:
        sight: Perceived state; own motion and command are used.
        else_do: Speed and steering angle of cars that are not blocked.
        params: Parameters of the recovery.
    """
    speed, angle = else_do
    gear, side = np.sign(speed), np.sign(angle)
    blocked = (np.abs(sight.speed) < params.still) & (np.abs(speed) > params.wants)
    blocked &= (np.abs(sight.steering - angle) < 0.05) & (np.abs(angle) > 0.05)
    rolls = -gear * sight.speed
    backs = (rolls > 0.05) & (rolls < 0.7 * params.speed)
    backs &= sight.steering * side > 0.8 * MAX_STEERING
    out = (blocked | backs) & (length(sight.command) > params.sent)
    if params.speed == 0.0:
        return else_do
    wheels = side * MAX_STEERING
    return np.where(out, -gear * params.speed, speed), np.where(out, wheels, angle)
