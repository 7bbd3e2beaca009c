"""Speed and steering of a nonholonomic car from a requested velocity.

The car steers along the circle through a point at distance L in the requested direction, at the
bearing e (pure pursuit [1]),

    curvature = 2 sin(e) / L,   steering = atan(wheelbase curvature),

so that e decays with the time constant L / 2v. With L in proportion to v the time constant is the
same at all speeds; the lookahead of the plan compensates it and the delay. Points behind the car
are pursued in reverse. Commands are delayed, so e is relative to the heading predicted for the time
when they act, from the car's own speed and steering angle.

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
"""Cosines of the bearing beyond which a car drives backwards: for a car that does not yet, and for
one that already does."""
ROLLING = 0.05
"""[m/s] Minimum speed at which a car counts as moving."""
MOST_TURN = 0.5
"""[rad] Upper limit of the predicted rotation before a command acts."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SteeringParams:
    """Parameters of the car and of path pursuit."""

    wheelbase: float = 0.30
    """[m] Wheelbase."""
    reach: float = 0.6
    """[s] Lookahead distance L divided by v. Smaller turns faster, and oscillates sooner."""
    least_reach: float = 0.3
    """[m] Minimum lookahead distance L."""
    delay: float = 0.1
    """[s] Delay of commands: half a control period, and the lags of servo and tyres."""
    start: float = 0.12
    """[m/s] Minimum requested velocity for a car at rest to start. Larger rests sooner, with a
    larger error."""
    stop: float = 0.05
    """[m/s] Requested velocity below which a moving car stops."""
    slowest: float = 0.25
    """[-] Minimum speed factor at large bearings."""
    shunting: ShuntingParams = field(default_factory=ShuntingParams)
    """Parameters of three-point turns."""
    freeing: FreeingParams = field(default_factory=FreeingParams)
    """Parameters of the recovery of blocked cars."""


def drive(
    sight: Sight,
    velocity: Plane,
    bounds: Bounds,
    params: SteeringParams,
    avoidance: AvoidanceParams,
) -> F32:
    """Return the actions for requested velocities, (..., 2).

    Args:
        sight: Perceived state; own motion and command are used.
        velocity: Requested velocity, (...) [m/s].
        bounds: Bounds of the speed.
        params: Parameters of the car and of path pursuit.
        avoidance: Parameters that the bounds were computed with.
    """
    speed = length(velocity)
    stops = speed < np.where(np.abs(sight.speed) < ROLLING, params.start, params.stop)
    inverse = 1.0 / np.maximum(speed, TINY)
    direction = _turned(sight, (velocity[0] * inverse, velocity[1] * inverse), params)
    c, s = direction
    back = c < np.where(sight.speed < -ROLLING, FORWARD_AGAIN, REVERSE_FROM)
    # In reverse, the wheels also point to the side of the circle's centre.
    c = np.where(back, -c, c)
    bend = np.where(c > 0.0, s, np.sign(s))
    rolls = np.where(back, -speed, speed) * np.maximum(c, params.slowest)
    reach = np.maximum(params.reach * speed, params.least_reach)
    angle = np.arctan((2.0 * params.wheelbase) * bend / reach)
    angle = np.minimum(np.maximum(angle, -MAX_STEERING), MAX_STEERING)
    rolls, angle = shunt(sight, speed, direction, (rolls, angle), params.wheelbase, params.shunting)
    rolls, angle = back_out(sight, (rolls, angle), params.freeing)

    rolls = bounded_speed(np.where(stops, 0.0, rolls), bounds, avoidance)
    actions = np.empty((*speed.shape, 2), np.float32)
    actions[..., 0] = np.minimum(np.maximum(rolls / MAX_SPEED, -1.0), 1.0)
    actions[..., 1] = np.where(stops, 0.0, angle / MAX_STEERING)
    return actions


def _turned(sight: Sight, direction: Plane, params: SteeringParams) -> Plane:
    """Return directions in the body frame predicted for the time when commands act."""
    turn = (params.delay / params.wheelbase) * sight.speed * sight.steering
    turn = np.minimum(np.maximum(turn, -MOST_TURN), MOST_TURN)
    # Rotation by atan(turn): equal for small angles, and exactly symmetric in left and right.
    share = 1.0 / np.sqrt(1.0 + turn * turn)
    c, s = direction
    return share * (c + turn * s), share * (s - turn * c)
