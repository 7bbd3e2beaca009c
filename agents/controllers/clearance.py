"""Keeping clear of what distance sensors see: the barrier of `avoidance`, for things that stand.

**Where to.** With the distance d from the body to the nearest point of a thing, in direction n, and
the distance D that is kept,

    v . n  <=  b (d - D):

velocities wanted are pushed back by what is beyond, so that what is left of them runs along a wall.
A thing is a beam that reads less than its neighbours.

**How fast.** A car is no disc, and turns as it goes: of all points those count that its body, wider
by the margin, will meet on the arc of its wheels, after the way s. Then

    |speed|  <=  b s.

**Which way.** Of some arcs the one is taken that is nearest to the one wanted, counted with what it
lacks of the way that the speed wanted needs. So a car that drives at a wall turns off along it [1],
and one that can turn nowhere backs out with its wheels turned the other way.

References:
    [1] Simmons, The curvature-velocity method for local obstacle avoidance, ICRA 1996.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np

from agents.controllers.base import TINY, Sight
from agents.controllers.bounds import Bounds
from agents.controllers.surroundings import HALF_CONE, HALF_LENGTH, HALF_WIDTH, Surroundings
from relpos_env.interface.actions import MAX_SPEED, MAX_STEERING
from relpos_env.interface.observations.base import F32
from tracking.arrays import F64

REAR = 0.156
"""[m] From the middle of the car to its rear axle, round a point next to which it turns."""
ROLLING = 0.05
"""[m/s] A car faster than this is in gear."""
WAYS = np.array([0.03, 0.06, 0.1, 0.15, 0.21, 0.28, 0.36, 0.46, 0.58, 0.72, 0.9])
"""[m] At which it is looked what the body meets."""
BEFORE = np.append(0.0, WAYS[:-1])


@dataclass(frozen=True, slots=True, kw_only=True)
class ClearanceParams:
    """How near cars come to what stands."""

    keep: float = 0.06
    """[m] D, from the body. Readings are wrong by 2 cm, and commands act late."""
    margin: float = 0.05
    """[m] Added to the body on all sides where it is looked what it meets."""
    per_gap: float = 0.1
    """[m/rad] Both grow with the angle between beams that no beam sees: there is more to miss."""
    rate: float = 2.0
    """[1/s] b. Larger comes nearer before it brakes."""
    retreat: float = 0.2
    """[m/s] Who is too near backs off at most so fast."""
    detour: float = 1.5
    """[rad] To stand in place of going as fast as wanted counts like so much of steering."""
    choices: int = 7
    """[-] Steering angles that are looked at, in either gear."""
    turn_back: float = 1.0
    """[rad] To change the gear counts like so much of steering."""
    go_on: float = 0.3
    """[rad] To go on in another gear than is wanted counts like so much."""
    wants: float = 0.15
    """[m/s] Who wants to go slower does not change the gear."""


def standing_bounds(around: Surroundings, params: ClearanceParams) -> Bounds:
    """How fast each car may go towards the nearest points of what stands; infinite for others."""
    distance, toward = around.to_body
    before, behind = np.roll(distance, 1, axis=-1), np.roll(distance, -1, axis=-1)
    nearest = (distance <= before) & (distance <= behind)
    allowed = np.maximum(
        params.rate * (distance - params.keep - _unseen(around, params)), -params.retreat
    )
    return Bounds(toward, np.where(nearest, allowed, np.inf))


def clear_way(around: Surroundings, curvature: F64, gear: F64, params: ClearanceParams) -> F64:
    """Way that the body can go along arcs before it meets a point, (...) [m]; infinite if none.

    A point that is within the margin from the start counts if the body comes nearer to it.

    Args:
        around: (..., beam), or with axes of size 1 that fit the arcs.
        curvature: Of the arcs, positive to the left, (...) [1/m].
        gear: 1 forwards, -1 backwards, (...).
        params: The margin.
    """
    way = WAYS[:, None] * gear[..., None, None]
    turn = way * curvature[..., None, None]
    c, s = np.cos(turn), np.sin(turn)
    # Where the middle of the car has gone, in its frame at the start: round the rear axle's centre.
    half = 0.5 * turn
    chord = way * np.sinc(half / np.pi)
    x = chord * np.cos(half) + REAR * (c - 1.0)
    y = chord * np.sin(half) + REAR * s
    dx, dy = around.ahead[..., None, :] - x, around.left[..., None, :] - y
    there = _outside(c * dx + s * dy, c * dy - s * dx)
    here = _outside(around.ahead, around.left)[..., None, :]
    margin = params.margin + _unseen(around, params)
    meets = there < np.minimum(margin, here - 1e-3)
    met = meets.any(axis=-1)
    # The way before the first at which something is met.
    clear: F64 = np.where(met.any(axis=-1), BEFORE[met.argmax(axis=-1)], np.inf)
    return clear


def clear_arc(
    around: Surroundings, sight: Sight, actions: F32, wheelbase: float, params: ClearanceParams
) -> None:
    """Replace actions by such as meet nothing, in place.

    Args:
        around: What stands.
        sight: Own motion is used.
        actions: (..., 2), see `agents.driver.Driver`.
        wheelbase: [m]
        params: How near.
    """
    speed, angle = actions[..., 0] * MAX_SPEED, actions[..., 1] * MAX_STEERING
    fastest = np.abs(speed)
    gear = np.where(speed < 0.0, -1.0, 1.0)
    fan = np.linspace(-MAX_STEERING, MAX_STEERING, params.choices)
    fan = np.broadcast_to(fan, (*angle.shape, params.choices))
    choices = np.concatenate([angle[..., None], fan, fan], axis=-1)
    same = np.arange(choices.shape[-1]) <= params.choices
    gears = np.where(same, gear[..., None], -gear[..., None])
    wide = Surroundings(around.ahead[..., None, :], around.left[..., None, :])
    ways = clear_way(wide, np.tan(choices) / wheelbase, gears, params)
    needed = fastest[..., None] / params.rate
    lacks = np.maximum(needed - ways, 0.0) / np.maximum(needed, TINY)
    # Backwards the wheels turn the bow to where it should go if they are turned the other way.
    side = np.where(angle >= 0.0, -MAX_STEERING, MAX_STEERING)
    off = np.abs(choices - np.where(same, angle[..., None], side[..., None]))
    rolling = sight.speed * gear < -ROLLING
    turned = np.where(rolling, params.go_on, params.turn_back)[..., None]
    turned = np.where(fastest[..., None] > params.wants, turned, np.inf)
    cost = off + params.detour * lacks + np.where(same, 0.0, turned)
    best = cost.argmin(axis=-1)[..., None]
    way, to, go = (np.take_along_axis(a, best, axis=-1)[..., 0] for a in (ways, choices, gears))
    actions[..., 0] = go * np.minimum(fastest, params.rate * way) / MAX_SPEED
    actions[..., 1] = to / MAX_STEERING


def _unseen(around: Surroundings, params: ClearanceParams) -> float:
    """What distances grow by for the gaps between beams [m]."""
    beams: int = around.ahead.shape[-1]
    return params.per_gap * max(2.0 * pi / beams - 2.0 * HALF_CONE, 0.0)


def _outside(x: F64, y: F64) -> F64:
    """Distance of points from the body, in its frame [m]."""
    dx = np.maximum(np.abs(x) - HALF_LENGTH, 0.0)
    dy = np.maximum(np.abs(y) - HALF_WIDTH, 0.0)
    distance: F64 = np.sqrt(dx * dx + dy * dy)
    return distance
