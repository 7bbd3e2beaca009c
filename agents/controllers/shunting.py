"""Places aside of the car: within its turning circle, where no arc leads.

A car reaches a point at distance d and angle e off the bow on an arc of radius ``d / (2 sin e)``,
so with the least radius R only if

    |sin e| <= d / 2R.

Else it first goes the other way with its wheels turned from the point. That turns the bow towards a
point ahead, or the stern towards one behind, and makes d larger, until an arc leads there: the
first stroke of a three-point turn, each stroke no longer than it must be. It is done only by cars
that the operator does not send anywhere: for those that are on the way, turning on is faster.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import tan

import numpy as np

from agents.controllers.base import Plane, Sight, length
from relpos_env.interface.actions import MAX_STEERING
from tracking.arrays import F64


@dataclass(frozen=True, slots=True, kw_only=True)
class ShuntingParams:
    """When cars shunt."""

    below: float = 0.45
    """[m/s] Velocity wanted: faster is farther than the turning circle. 0 never shunts."""
    unsent: float = 0.3
    """[m/s] Commands below this are none."""
    horizon: float = 1.4
    """[s] d per velocity wanted: the inverse of the gain."""
    speed: float = 0.25
    """[m/s] Of the stroke."""
    until: float = 0.5
    """[-] Under way the stroke goes on until sin e is this share of what would do."""


def shunt(
    sight: Sight,
    speed: F64,
    direction: Plane,
    else_do: Plane,
    wheelbase: float,
    params: ShuntingParams,
) -> Plane:
    """Speed [m/s] and steering angle [rad] of cars, each (...).

    Args:
        sight: Own motion and command are used.
        speed: Wanted, (...) [m/s].
        direction: Wanted, cosine and sine off the bow, (...).
        else_do: Speed and steering angle of cars that need not shunt.
        wheelbase: [m]
        params: When.
    """
    c, s = direction
    rolling = np.where(np.abs(sight.speed) < 0.05, 0.0, np.sign(sight.speed))
    # Who has begun a stroke does not change his mind for a point that is abeam.
    gear = np.where(c > 0.2 * rolling, -1.0, 1.0)
    enough = (0.5 * params.horizon * tan(MAX_STEERING) / wheelbase) * speed
    enough = np.where(rolling == gear, params.until, 1.0) * enough
    due = (np.abs(s) > enough) & (speed < params.below)
    due &= length(sight.command) < params.unsent
    wheels = -np.sign(s) * MAX_STEERING
    return np.where(due, gear * params.speed, else_do[0]), np.where(due, wheels, else_do[1])
