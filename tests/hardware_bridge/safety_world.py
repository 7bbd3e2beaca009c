"""Many groups of cars with one gate each, driven by adversarial policies, with faults.

The guarantees of the gate are checked on the true state: the centre of no car is outside the fence,
and no two centres are nearer than the separation.
"""

from typing import NamedTuple

import numpy as np
from safety_cars import DT, Cars
from safety_estimates import Estimates
from safety_faults import KINDS, Faults
from safety_policies import Policies

from hardware_bridge.safety.gate import Gate
from hardware_bridge.safety.geometry.polygon import to_edges
from hardware_bridge.safety.params import Fence

DECISION = 10
"""[ticks] Control period."""
ROOM = Fence(node=9, corners=((0.0, 0.0), (5.0, 0.0), (5.0, 4.0), (0.0, 4.0)))
CORNER = Fence(
    node=9,
    corners=((0.0, 0.0), (6.0, 0.0), (6.0, 3.5), (3.5, 3.5), (3.5, 6.0), (0.0, 6.0)),
)
"""A fence with a reflex corner."""


class Outcome(NamedTuple):
    """Results of runs, arrays over (env) except the last three."""

    nearest: np.ndarray
    """Smallest distance of two centres [m]."""
    furthest: np.ndarray
    """Largest distance of a centre outside the fence; negative inside [m]."""
    way: np.ndarray
    """Distance travelled by all cars [m]."""
    armed: float
    """Fraction of time in which cars were armed."""
    capped: float
    """Fraction of the armed time in which the allowed speed was below the requested one."""
    n_armings: int
    """Number of cars armed again after a stop."""


def start(n_envs, n_cars, corners, rng):
    """Sample positions inside the fence, 0.6 m from it and 1.3 m apart if possible."""
    low, high = np.min(corners, axis=0), np.max(corners, axis=0)
    pos = np.zeros((n_envs, n_cars, 2))
    for k in range(n_cars):
        todo, apart = np.arange(n_envs), 1.3
        while len(todo):
            drawn = rng.uniform(low, high, (len(todo), 2))
            inside, offset = to_edges(drawn, np.array(corners))
            good = inside & (np.linalg.norm(offset, axis=-1).min(axis=-1) > 0.6)
            gaps = np.linalg.norm(pos[todo, :k] - drawn[:, None], axis=-1)
            good &= gaps.min(axis=-1, initial=np.inf) > apart
            pos[todo[good], k] = drawn[good]
            todo, apart = todo[~good], apart * 0.99
    return pos, rng.uniform(-np.pi, np.pi, (n_envs, n_cars))


def run(params, n_envs, seconds, seed, *, n_cars=4, kinds=KINDS, sigma=(0.03, 0.3), deciding=None):
    """Simulate 2 to `n_cars` cars per group. `deciding` replaces the policies."""
    rng = np.random.default_rng(seed)
    pos, heading = start(n_envs, n_cars, params.fence.corners, rng)
    cars, gate = Cars(pos, heading, rng), Gate(params, n_envs, n_cars)
    present = np.arange(n_cars) < rng.integers(2, n_cars + 1, n_envs)[:, None]
    estimates = Estimates(n_envs, n_cars, rng, sigma)
    policies = deciding or Policies(present.shape, rng)
    faults = Faults(n_envs, n_cars, rng, kinds)
    corners = np.array(params.fence.corners)
    shape = present.shape
    word, heard, now = np.full(n_envs, -1.0), np.full(shape, -1.0), np.zeros(n_envs)
    nearest, furthest, way = np.full(n_envs, np.inf), np.full(n_envs, -np.inf), np.zeros(n_envs)
    apart = present[:, :, None] & present[:, None, :] & ~np.eye(n_cars, dtype=bool)
    armed = capped = n_armings = 0
    picture = None
    for tick in range(round(seconds / DT)):
        now[:] = tick * DT
        faults.step(now)
        estimates.watch(cars, present)
        speaks = ~faults.silence
        if tick % DECISION == 0:
            new = estimates.picture(now, cars, present, DECISION * DT, faults)
            speed, steering = policies.decide(cars.pos, cars.heading, present)
            new.requested_speed[:], new.requested_steering[:] = speed, steering
            if picture is None:
                picture = new
            takes = speaks & ~faults.held
            for old, fresh in zip(picture, new, strict=True):
                old[takes] = fresh[takes]
        word = np.where(speaks, now, word)
        if tick % 2 == 0:
            heard = np.where(faults.stale, heard, now[:, None])
        linked = faults.linked
        out = gate.step(picture, now, word, heard, linked)
        n_armings += int((gate.arm(now, present & ~gate.armed) & ~out.armed).sum())
        armed += out.armed.sum() / present.sum()
        capped += (
            out.armed & (out.cap < np.minimum(np.abs(picture.requested_speed), params.max_speed))
        )[present].sum() / max(out.armed.sum(), 1)
        before = cars.pos.copy()
        cars.step(out.speed, out.steering, out.moving, linked)
        way += np.where(present, np.linalg.norm(cars.pos - before, axis=-1), 0.0).sum(axis=-1)
        gaps = np.linalg.norm(cars.pos[:, None, :] - cars.pos[:, :, None], axis=-1)
        nearest = np.minimum(nearest, np.where(apart, gaps, np.inf).min(axis=(1, 2)))
        inside, offset = to_edges(cars.pos, corners)
        outside = np.linalg.norm(offset, axis=-1).min(axis=-1) * np.where(inside, -1.0, 1.0)
        furthest = np.maximum(furthest, np.where(present, outside, -np.inf).max(axis=-1))
    n_ticks = round(seconds / DT)
    return Outcome(nearest, furthest, way, armed / n_ticks, capped / n_ticks, n_armings)
