"""What came of a step: rewards, who takes part, what is over, and how far estimates are off."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from tracking.kernels.jit import kernel


class TeamResults(NamedTuple):
    """What came of a step for all cars of an environment that take part, arrays over (env)."""

    reward: np.ndarray
    """Mean."""
    error: np.ndarray
    """Formation error, mean of those in the room [m]."""
    contacts: np.ndarray
    """Begun in the step, of all cars, whether or not they take part."""


@kernel
def judge(
    first, end, present, to_come, contacts, error, terms, weights, done, cycles, max_cycles,
    collision_ends, time, rewards, team, active, left, terminated, truncated,
):  # fmt: skip
    """Sum rewards up, and note who left and which episodes are over.

    Args:
        first: First environment.
        end: The one after the last.
        present: Cars in the room, (env, car).
        to_come: Cars that will come in, (env, car).
        contacts: Begun in the step, (env, car).
        error: Formation errors, (env, car) [m].
        terms: Reward terms, (env, car, term); that of time is updated where a contact is the end.
        weights: (term)
        done: The task is accomplished, (env).
        cycles: Steps of the episode, (env).
        max_cycles: After so many it is over.
        collision_ends: Whether a contact ends it.
        time: Number of the term of that name, -1 if the task has none.
        rewards: (env, car), written.
        team: TeamResults, written.
        active: Cars that take part, (env, car), updated.
        left: Cars that left for good, (env, car), written.
        terminated: (env), written.
        truncated: (env), written.
    """
    for e in range(first, end):
        terminated[e] = done[e]
        truncated[e] = cycles[e] >= max_cycles
        team.reward[e] = team.error[e] = team.contacts[e] = 0.0
        size, here = 0, 0
        hit = False
        for n in range(present.shape[1]):
            hit = hit or contacts[e, n] > 0.0
        # Who runs into something is not through: it pays for the time that was left.
        unpaid = max(max_cycles - cycles[e], 0) if collision_ends and hit and not done[e] else 0
        for n in range(present.shape[1]):
            if present[e, n] and time >= 0:
                terms[e, n, time] -= unpaid
            total = 0.0
            for k in range(weights.shape[0]):
                total += weights[k] * terms[e, n, k]
            rewards[e, n] = total
            stays = present[e, n] or (active[e, n] and to_come[e, n])
            left[e, n] = active[e, n] and not stays
            active[e, n] = stays
            team.contacts[e] += contacts[e, n]
            if stays:
                team.reward[e] += total
                size += 1
            if present[e, n]:
                team.error[e] += error[e, n]
                here += 1
        team.reward[e] /= max(size, 1)
        team.error[e] /= max(here, 1)
        if collision_ends and hit:
            terminated[e] = True


@kernel
def tracking_errors(body, believed, ok, out):
    """Distance of believed from true relative positions, mean over the others that can be used.

    Args:
        body: The truth: x and y first, (env, car, 6) [m].
        believed: (env, car, other, 2) [m]
        ok: Where an estimate can be used, (env, car, other).
        out: (env, car) [m], written; NaN where none can.
    """
    for e in range(out.shape[0]):
        for a in range(out.shape[1]):
            total, n = 0.0, 0
            for b in range(out.shape[1]):
                if ok[e, a, b]:
                    x = believed[e, a, b, 0] - (body[e, b, 0] - body[e, a, 0])
                    y = believed[e, a, b, 1] - (body[e, b, 1] - body[e, a, 1])
                    total += math.sqrt(x * x + y * y)
                    n += 1
            out[e, a] = total / n if n > 0 else math.nan
