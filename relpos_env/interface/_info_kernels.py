"""Compiled values of the infos of cars."""

from __future__ import annotations

import math

from tracking.kernels.jit import kernel


@kernel
def write_figures(error, tracking, ok, pos, present, contacts, rewards, weights, done, figures):
    """Write the info values of all cars of all environments.

    Args:
        error: Formation errors, (env, car) [m].
        tracking: Errors of estimates, (env, car) [m]; NaN where there is no estimate.
        ok: True where an estimate is usable, (env, car, other).
        pos: Estimates, (env, car, other, 2) [m].
        present: True where the car is present, (env, car).
        contacts: Number of contacts begun in the step, (env, car).
        rewards: Reward terms, unweighted, (env, car, term).
        weights: Reward weights, (term).
        done: True where the task is done, (env).
        figures: `relpos_env.interface.infos.Figures`, written.
    """
    for e in range(error.shape[0]):
        for n in range(error.shape[1]):
            figures.formation_error[e, n] = error[e, n] if present[e, n] else math.inf
            known = not math.isnan(tracking[e, n])
            figures.tracking_error[e, n] = tracking[e, n] if known else math.inf
            tracked = 0
            squared, both = 0.0, 0
            for m in range(ok.shape[2]):
                tracked += ok[e, n, m]
                if ok[e, n, m] and ok[e, m, n]:
                    x, y = pos[e, n, m, 0] + pos[e, m, n, 0], pos[e, n, m, 1] + pos[e, m, n, 1]
                    squared, both = squared + x * x + y * y, both + 1
            figures.tracked[e, n] = tracked
            figures.disagreement[e, n] = math.sqrt(squared / both) if both > 0 else math.inf
            figures.collisions[e, n] = contacts[e, n]
            figures.is_success[e, n] = done[e]
            for k in range(weights.shape[0]):
                figures.parts[e, n, k] = weights[k] * rewards[e, n, k]
