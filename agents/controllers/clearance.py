"""Clearance from obstacles by distance sensors: the barrier of `avoidance` for static points.

**Velocity.** With the distance d from the body to the nearest point of an obstacle, in direction n,
and the minimum distance D,

    v . n  <=  b (d - D).

The excess is subtracted from requested velocities; the remainder is parallel to the wall. The bound
applies to rays with a local minimum of the distance.

**Speed.** The body is not a disc, and it turns as it moves. With the path length s at which the
body, enlarged by a margin, first meets a point on the arc of its wheels,

    |speed|  <=  b s.

**Arc.** The arc with the least cost is selected from several candidates. The cost is the deviation
from the requested steering angle plus a penalty for missing path length. A car that drives at a
wall turns off along it [1]; one without a free arc backs out with opposite steering.

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
"""[m] Distance from the middle of the car to its rear axle, in line with the centre of turning."""
ROLLING = 0.05
"""[m/s] Minimum speed at which a car counts as moving forwards or backwards."""
WAYS = np.array([0.03, 0.06, 0.1, 0.15, 0.21, 0.28, 0.36, 0.46, 0.58, 0.72, 0.9])
"""[m] Path lengths at which the body is checked for contacts."""
BEFORE = np.append(0.0, WAYS[:-1])


@dataclass(frozen=True, slots=True, kw_only=True)
class ClearanceParams:
    """Parameters of the distances from obstacles."""

    keep: float = 0.06
    """[m] Minimum distance D from the body. Readings err by 2 cm, and commands are delayed."""
    margin: float = 0.05
    """[m] Margin on all sides of the body in the check for contacts along arcs."""
    per_gap: float = 0.1
    """[m/rad] Increase of `keep` and `margin` per angle between sensor cones, a blind sector."""
    rate: float = 2.0
    """[1/s] Rate b. Larger brakes later."""
    retreat: float = 0.2
    """[m/s] Maximum speed away from an obstacle that is too near."""
    detour: float = 1.5
    """[rad] Cost of an arc on which the car cannot move, as a steering angle."""
    choices: int = 7
    """[-] Number of candidate steering angles, forwards and backwards each."""
    turn_back: float = 1.0
    """[rad] Cost of reversing the direction of travel, as a steering angle."""
    go_on: float = 0.3
    """[rad] Cost of continuing against the requested direction of travel, as a steering angle."""
    wants: float = 0.15
    """[m/s] Minimum requested speed at which the direction of travel may be reversed."""


def clearance_bounds(around: Surroundings, params: ClearanceParams) -> Bounds:
    """Return the largest velocity towards the nearest points of obstacles; infinite for others."""
    distance, toward = around.to_body
    before, behind = np.roll(distance, 1, axis=-1), np.roll(distance, -1, axis=-1)
    nearest = (distance <= before) & (distance <= behind)
    allowed = np.maximum(
        params.rate * (distance - params.keep - _unseen(around, params)), -params.retreat
    )
    return Bounds(toward, np.where(nearest, allowed, np.inf))


def clear_way(around: Surroundings, curvature: F64, gear: F64, params: ClearanceParams) -> F64:
    """Return the path length on arcs before the body meets a point, (...) [m]; infinite if none.

    A point that is within the margin at the start counts if the body comes nearer to it.

    Args:
        around: Points, (..., ray), or with axes of size 1 that broadcast to the arcs.
        curvature: Curvature of the arcs, positive to the left, (...) [1/m].
        gear: 1 forwards, -1 backwards, (...).
        params: Parameters with the margin.
    """
    way = WAYS[:, None] * gear[..., None, None]
    turn = way * curvature[..., None, None]
    c, s = np.cos(turn), np.sin(turn)
    # Displacement of the car's middle in its initial body frame; the rear axle follows the arc.
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
    # The last checked path length before the first contact.
    clear: F64 = np.where(met.any(axis=-1), BEFORE[met.argmax(axis=-1)], np.inf)
    return clear


def clear_arc(
    around: Surroundings, sight: Sight, actions: F32, wheelbase: float, params: ClearanceParams
) -> None:
    """Replace actions by the collision-free arcs of least cost, in place.

    Args:
        around: Points on obstacles.
        sight: Perceived state; the own motion is used.
        actions: Actions, (..., 2), see `agents.driver.Driver`.
        wheelbase: Wheelbase [m].
        params: Distances and costs.
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
    # In reverse, opposite steering turns the bow in the requested direction.
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
    """Return the increase of distances for the angles between sensor cones [m]."""
    n_rangefinders: int = around.ahead.shape[-1]
    return params.per_gap * max(2.0 * pi / n_rangefinders - 2.0 * HALF_CONE, 0.0)


def _outside(x: F64, y: F64) -> F64:
    """Return the distance of points in the body frame from the body [m]."""
    dx = np.maximum(np.abs(x) - HALF_LENGTH, 0.0)
    dy = np.maximum(np.abs(y) - HALF_WIDTH, 0.0)
    distance: F64 = np.sqrt(dx * dx + dy * dy)
    return distance
