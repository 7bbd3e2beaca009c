"""What is not seen: without distance sensors a car finds walls and boxes with its bumper.

A car that the operator sends somewhere, that does not move though it wants to, and whose wheels are
already turned as they should be, is taken for blocked; one that has just started still has its
wheels straight. It backs out with its wheels as they are, which turns the bow from what is in the
way, until it has reached some speed; the speed and the lock of its wheels tell it that it is
backing out. Then it tries again, from elsewhere and with another heading.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from agents.controllers.base import Plane, Sight, length
from relpos_env.interface.actions import MAX_STEERING


@dataclass(frozen=True, slots=True, kw_only=True)
class FreeingParams:
    """How a car backs out."""

    speed: float = 1.0
    """[m/s] Backing out ends at 0.7 of this. Larger gets farther away; 0 never backs out."""
    sent: float = 0.5
    """[m/s] Commands faster than this send a car somewhere."""
    still: float = 0.02
    """[m/s] Slower is standing. Larger finds obstacles sooner, and some where there are none."""
    wants: float = 0.15
    """[m/s] Less is no attempt to move."""


def back_out(sight: Sight, else_do: Plane, params: FreeingParams) -> Plane:
    """Speed [m/s] and steering angle [rad] of cars, each (...).

    Args:
        sight: Own motion and command are used.
        else_do: Speed and steering angle of cars that are not blocked.
        params: How.
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
