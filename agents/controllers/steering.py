"""From the velocity that is wanted to speed and steering of a car that cannot move sideways.

The car steers along the circle through a point at distance L in the wanted direction, which is at
the angle e off the bow (pure pursuit [1]),

    curvature = 2 sin(e) / L,   steering = atan(wheelbase curvature),

so that e decays with the time constant L / 2v; with L in proportion to v it is the same at all
speeds, and with the delay it makes up the lookahead of the plan. What lies behind is pursued
backwards, as if rear were front. Commands act late: e is counted from the heading which the car
will have when they do, by its own speed and steering angle.

References:
    [1] Coulter, Implementation of the pure pursuit path tracking algorithm, CMU-RI-TR-92-01.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import cos, radians

import numpy as np

from agents.controllers.avoidance import AvoidanceParams, bounded_speed
from agents.controllers.base import TINY, Plane, Sight, length
from agents.controllers.bounds import Bounds
from agents.controllers.freeing import FreeingParams, back_out
from agents.controllers.shunting import ShuntingParams, shunt
from relpos_env.interface.actions import MAX_SPEED, MAX_STEERING
from relpos_env.interface.observations.base import F32

REVERSE_FROM, FORWARD_AGAIN = cos(radians(120.0)), cos(radians(100.0))
"""Cosines of the angle off the bow beyond which a car goes backwards: one that rolls forwards, and
one that rolls backwards already."""
ROLLING = 0.05
"""[m/s] A car faster than this is in gear."""
MOST_TURN = 0.5
"""[rad] A car turns by so much at most before a command acts."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SteeringParams:
    """The car, and how it pursues."""

    wheelbase: float = 0.30
    """[m]"""
    reach: float = 0.6
    """[s] L / v. Shorter turns faster, and swings sooner."""
    least_reach: float = 0.3
    """[m] L at least."""
    delay: float = 0.1
    """[s] Until a command acts: half a decision, and the lags of servo and tyres."""
    start: float = 0.12
    """[m/s] A car that stands stays while less than this is wanted. Larger rests sooner, with a
    larger error."""
    stop: float = 0.05
    """[m/s] A car that rolls stops when less than this is wanted."""
    slowest: float = 0.25
    """[-] Share of the speed that is left, however far off the bow."""
    shunting: ShuntingParams = field(default_factory=ShuntingParams)
    """Places aside of the car."""
    freeing: FreeingParams = field(default_factory=FreeingParams)
    """What was not seen."""


def drive(
    sight: Sight,
    velocity: Plane,
    bounds: Bounds,
    params: SteeringParams,
    avoidance: AvoidanceParams,
) -> F32:
    """Actions of cars that want velocities, (..., 2).

    Args:
        sight: Own motion is used.
        velocity: Wanted, (...) [m/s].
        bounds: What the speed is held within.
        params: The car.
        avoidance: What the bounds are from.
    """
    speed = length(velocity)
    stands = speed < np.where(np.abs(sight.speed) < ROLLING, params.start, params.stop)
    inverse = 1.0 / np.maximum(speed, TINY)
    direction = _turned(sight, (velocity[0] * inverse, velocity[1] * inverse), params)
    c, s = direction
    back = c < np.where(sight.speed < -ROLLING, FORWARD_AGAIN, REVERSE_FROM)
    # To go backwards along a circle the wheels point to the side on which its middle is.
    c = np.where(back, -c, c)
    bend = np.where(c > 0.0, s, np.sign(s))
    rolls = np.where(back, -speed, speed) * np.maximum(c, params.slowest)
    reach = np.maximum(params.reach * speed, params.least_reach)
    angle = np.arctan((2.0 * params.wheelbase) * bend / reach)
    angle = np.minimum(np.maximum(angle, -MAX_STEERING), MAX_STEERING)
    rolls, angle = shunt(sight, speed, direction, (rolls, angle), params.wheelbase, params.shunting)
    rolls, angle = back_out(sight, (rolls, angle), params.freeing)

    rolls = bounded_speed(np.where(stands, 0.0, rolls), bounds, avoidance)
    actions = np.empty((*speed.shape, 2), np.float32)
    actions[..., 0] = np.minimum(np.maximum(rolls / MAX_SPEED, -1.0), 1.0)
    actions[..., 1] = np.where(stands, 0.0, angle / MAX_STEERING)
    return actions


def _turned(sight: Sight, direction: Plane, params: SteeringParams) -> Plane:
    """Directions in the frame that the car will have when commands act."""
    turn = (params.delay / params.wheelbase) * sight.speed * sight.steering
    turn = np.minimum(np.maximum(turn, -MOST_TURN), MOST_TURN)
    # By atan(turn), which is as good for small angles and has the exact symmetry of sides.
    share = 1.0 / np.sqrt(1.0 + turn * turn)
    c, s = direction
    return share * (c + turn * s), share * (s - turn * c)
