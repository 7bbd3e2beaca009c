"""Three-point turns to points inside the turning circle, which no arc reaches.

A car reaches a point at distance d and bearing e on an arc of radius ``d / (2 sin e)``, so with the
minimum radius R only if

    |sin e| <= d / 2R.

Otherwise it first drives in the opposite direction with its wheels turned away from the point. This
turns the bow to a point ahead, or the stern to one behind, and increases d until an arc reaches the
point: the first stroke of a three-point turn, no longer than necessary. Only cars without a command
shunt; with a command it is faster to keep turning.
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
    """Parameters of three-point turns."""

    below: float = 0.45
    """[m/s] Requested velocity below which the target is in the turning circle. 0 disables."""
    unsent: float = 0.3
    """[m/s] Commands below this count as none."""
    horizon: float = 1.4
    """[s] Distance d per requested velocity: the inverse of the gain."""
    speed: float = 0.25
    """[m/s] Speed of the stroke."""
    until: float = 0.5
    """[-] A stroke under way ends when sin e is this fraction of its limit d / 2R."""


def shunt(
    sight: Sight,
    speed: F64,
    direction: Plane,
    else_do: Plane,
    wheelbase: float,
    params: ShuntingParams,
) -> Plane:
    """Return speed [m/s] and steering angle [rad] with three-point turns, each (...).

    Args:
        sight: Perceived state; own motion and command are used.
        speed: Requested speed, (...) [m/s].
        direction: Cosine and sine of the requested bearing, (...).
        else_do: Speed and steering angle of cars that need no three-point turn.
        wheelbase: Wheelbase [m].
        params: Parameters of three-point turns.
    """
    c, s = direction
    rolling = np.where(np.abs(sight.speed) < 0.05, 0.0, np.sign(sight.speed))
    # Hysteresis: a stroke under way keeps its direction for a point that is abeam.
    gear = np.where(c > 0.2 * rolling, -1.0, 1.0)
    enough = (0.5 * params.horizon * tan(MAX_STEERING) / wheelbase) * speed
    enough = np.where(rolling == gear, params.until, 1.0) * enough
    due = (np.abs(s) > enough) & (speed < params.below)
    due &= length(sight.command) < params.unsent
    wheels = -np.sign(s) * MAX_STEERING
    return np.where(due, gear * params.speed, else_do[0]), np.where(due, wheels, else_do[1])
