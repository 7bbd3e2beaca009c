"""Collision avoidance from estimates: a barrier on how fast a car may close in.

With the distance d to another car in direction n, and the distance D that is kept, cars may
approach no faster than the room that is left,

    (v_i - v_j) . n  <=  b (d - D),

so that d - D decays at the rate b at most and stays positive [1]. Both give way: each changes its
own velocity by half of what is too much, as in [2],

    v . n  <=  (v_i . n + v_j . n + b (d - D)) / 2.

Where the estimate tells a covariance, D grows with the standard deviation along n. Velocities
wanted are pushed back by what they are beyond the bounds; since a car does not move where it wants
at once, the speed along its heading is bounded by the same rule.

References:
    [1] Wang, Ames, Egerstedt, Safety barrier certificates for collisions-free multirobot systems,
        IEEE Transactions on Robotics 33 (2017) 661.
    [2] van den Berg, Guy, Lin, Manocha, Reciprocal n-body collision avoidance, ISRR 2011.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from agents.controllers.base import TINY, Plane, Sight, length
from agents.controllers.bounds import Bounds
from agents.controllers.caution import spread
from agents.controllers.clearance import ClearanceParams
from tracking.arrays import F64

ABEAM = 0.1
"""[-] Who is off the bow by an angle whose cosine is less is neither approached nor left."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AvoidanceParams:
    """How near cars may come."""

    keep: float = 0.55
    """[m] D, between centres. Two cars of 0.42 m by 0.20 m touch below 0.47 m at most."""
    keep_per_std: float = 0.5
    """[-] D grows by so many standard deviations of the distance."""
    most_doubt: float = 0.3
    """[m] By so much at most, or a car that is unsure would never move."""
    rate: float = 2.0
    """[1/s] b. Larger comes nearer before it brakes; 2.5 m/s2 of brake stop 1.25 m/s in 0.3 m."""
    retreat: float = 0.4
    """[m/s] A car too near backs off at most so fast."""
    sweeps: int = 2
    """[-] The bounds of all others are applied so often, each time those still broken."""
    clearance: ClearanceParams = field(default_factory=ClearanceParams)
    """How near to what stands, where there are sensors for it."""


def closing_bounds(sight: Sight, params: AvoidanceParams) -> Bounds:
    """How fast each car may go towards each other one."""
    distance = length(sight.pos)
    inverse = 1.0 / np.maximum(distance, TINY)
    toward = sight.pos[0] * inverse, sight.pos[1] * inverse
    room = distance - params.keep
    if sight.certainty is not None:
        doubt = params.keep_per_std * spread(toward, sight.certainty)
        room -= np.minimum(doubt, params.most_doubt)
    allowed = params.rate * room
    if sight.vel is not None:
        own = toward[0] * sight.speed[..., None]
        away = toward[0] * sight.vel[0] + toward[1] * sight.vel[1]
        allowed += 2.0 * own + away
    closing = np.where(sight.ok, np.maximum(0.5 * allowed, -params.retreat), np.inf)
    return Bounds(toward, closing)


def pushed_back(velocity: Plane, bounds: Bounds, params: AvoidanceParams) -> Plane:
    """Velocities without what is beyond the bounds, (...) [m/s]."""
    x, y = velocity
    to_x, to_y = bounds.toward
    for _ in range(params.sweeps):
        beyond = np.maximum(to_x * x[..., None] + to_y * y[..., None] - bounds.closing, 0.0)
        x, y = x - (beyond * to_x).sum(axis=-1), y - (beyond * to_y).sum(axis=-1)
    return x, y


def bounded_speed(speed: F64, bounds: Bounds, params: AvoidanceParams) -> F64:
    """Speeds along the heading within the bounds, (...) [m/s].

    Who is between others that are too near stands.
    """
    ahead = bounds.toward[0]
    share = bounds.closing / np.where(np.abs(ahead) > ABEAM, ahead, 1.0)
    most = np.where(ahead > ABEAM, share, np.inf).min(axis=-1)
    least = np.where(ahead < -ABEAM, share, -np.inf).max(axis=-1)
    most, least = np.maximum(most, -params.retreat), np.minimum(least, params.retreat)
    bounded: F64 = np.where(least > most, 0.0, np.minimum(np.maximum(speed, least), most))
    return bounded
