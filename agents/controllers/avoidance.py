"""Collision avoidance from estimates: control barrier functions on the closing speed.

With the distance d to another car in direction n, and the minimum distance D, the closing speed
is limited to

    (v_i - v_j) . n  <=  b (d - D),

so that d - D decays at most at the rate b and stays positive [1]. Both cars give way: each changes
its own velocity by half of the excess, as in [2],

    v . n  <=  (v_i . n + v_j . n + b (d - D)) / 2.

With a covariance, D grows with the standard deviation along n. The excess over the bounds is
subtracted from requested velocities. A car cannot change its direction of motion at once, so the
speed along its heading has the same bounds.

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
"""[-] Cosine of the bearing below which a car is abeam and does not bound the speed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AvoidanceParams:
    """Parameters of the distances between cars."""

    keep: float = 0.55
    """[m] Minimum distance D between centres. Cars of 0.42 m by 0.20 m touch at 0.47 m at most."""
    keep_per_std: float = 0.5
    """[-] Increase of D in standard deviations of the distance."""
    most_doubt: float = 0.3
    """[m] Upper limit of this increase, so that a car with uncertain estimates can move."""
    rate: float = 2.0
    """[1/s] Rate b. Larger brakes later; a deceleration of 2.5 m/s2 stops 1.25 m/s in 0.3 m."""
    retreat: float = 0.4
    """[m/s] Maximum speed away from a car that is too near."""
    sweeps: int = 2
    """[-] Number of passes over the bounds, each with those still violated."""
    clearance: ClearanceParams = field(default_factory=ClearanceParams)
    """Clearance from obstacles, for cars with distance sensors."""


def closing_bounds(sight: Sight, params: AvoidanceParams) -> Bounds:
    """Return the largest velocity of each car towards each other car."""
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
    """Return velocities without their excess over the bounds, (...) [m/s]."""
    x, y = velocity
    to_x, to_y = bounds.toward
    for _ in range(params.sweeps):
        beyond = np.maximum(to_x * x[..., None] + to_y * y[..., None] - bounds.closing, 0.0)
        x, y = x - (beyond * to_x).sum(axis=-1), y - (beyond * to_y).sum(axis=-1)
    return x, y


def bounded_speed(speed: F64, bounds: Bounds, params: AvoidanceParams) -> F64:
    """Return speeds along the heading within the bounds, (...) [m/s].

    The speed is 0 where the bounds ahead and behind contradict each other.
    """
    ahead = bounds.toward[0]
    share = bounds.closing / np.where(np.abs(ahead) > ABEAM, ahead, 1.0)
    most = np.where(ahead > ABEAM, share, np.inf).min(axis=-1)
    least = np.where(ahead < -ABEAM, share, -np.inf).max(axis=-1)
    most, least = np.maximum(most, -params.retreat), np.minimum(least, params.retreat)
    bounded: F64 = np.where(least > most, 0.0, np.minimum(np.maximum(speed, least), most))
    return bounded
