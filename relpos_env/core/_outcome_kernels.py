"""Outcome of a step: rewards, participating cars, ends of episodes and tracking errors."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from tracking.kernels.jit import kernel


class TeamResults(NamedTuple):
    """Outcome of a step over the cars of an environment, arrays over (env)."""

    reward: np.ndarray
    """Mean reward of the participating cars."""
    error: np.ndarray
    """Formation error, mean over the cars in the room [m]."""
    contacts: np.ndarray
    """Contacts begun in the step by all cars, participating or not."""


@kernel
def judge(
    first, end, present, to_come, contacts, error, terms, weights, done, cycles, max_cycles,
    collision_ends, time, rewards, team, active, left, terminated, truncated,
):  # fmt: skip
    """Compute rewards, departed cars and ends of episodes.

    Args:
        first: First environment.
        end: One past the last environment.
        present: Cars in the room, (env, car).
        to_come: Cars that will join, (env, car).
        contacts: Contacts begun in the step, (env, car).
        error: Formation errors, (env, car) [m].
        terms: Reward terms, (env, car, term); the one of time is updated if a contact terminates.
        weights: Weights of the terms, (term).
        done: True if the task is accomplished, (env).
        cycles: Steps of the episode, (env).
        max_cycles: Steps until truncation.
        collision_ends: True if a contact terminates the episode.
        time: Index of the time term, -1 if the task has none.
        rewards: Weighted sums of the terms, (env, car), written.
        team: TeamResults, written.
        active: Participating cars, (env, car), updated.
        left: Cars that left for good, (env, car), written.
        terminated: Terminated episodes, (env), written.
        truncated: Truncated episodes, (env), written.
    """
    for e in range(first, end):
        terminated[e] = done[e]
        truncated[e] = cycles[e] >= max_cycles
        team.reward[e] = team.error[e] = team.contacts[e] = 0.0
        size, here = 0, 0
        hit = False
        for n in range(present.shape[1]):
            hit = hit or contacts[e, n] > 0.0
        # A collision does not accomplish the task: it costs the remaining time.
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
def tracking_errors(body, estimated, ok, out):
    """Write the mean distance of estimated from true relative positions of usable estimates.

    Args:
        body: True states, x and y first, (env, car, 6) [m].
        estimated: Estimated relative positions, (env, car, other, 2) [m].
        ok: Mask of usable estimates, (env, car, other).
        out: Mean distances, (env, car) [m], written; NaN without usable estimates.
    """
    for e in range(out.shape[0]):
        for a in range(out.shape[1]):
            total, n = 0.0, 0
            for b in range(out.shape[1]):
                if ok[e, a, b]:
                    x = estimated[e, a, b, 0] - (body[e, b, 0] - body[e, a, 0])
                    y = estimated[e, a, b, 1] - (body[e, b, 1] - body[e, a, 1])
                    total += math.sqrt(x * x + y * y)
                    n += 1
            out[e, a] = total / n if n > 0 else math.nan
