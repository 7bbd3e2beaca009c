"""The figures of cars that infos tell."""

from __future__ import annotations

import math

from tracking.kernels.jit import kernel


@kernel
def write_figures(error, tracking, ok, present, contacts, rewards, weights, done, figures):
    """Write the figures of all cars of all environments.

    Args:
        error: Formation errors, (env, car) [m].
        tracking: Errors of estimates, (env, car) [m]; NaN where there is none.
        ok: Where an estimate can be used, (env, car, other).
        present: (env, car)
        contacts: Begun in the step, (env, car).
        rewards: Terms, (env, car, term).
        weights: (term)
        done: The task is accomplished, (env).
        figures: `relpos_env.interface.infos.Figures`, written.
    """
    for e in range(error.shape[0]):
        for n in range(error.shape[1]):
            figures.formation_error[e, n] = error[e, n] if present[e, n] else math.inf
            known = not math.isnan(tracking[e, n])
            figures.tracking_error[e, n] = tracking[e, n] if known else math.inf
            tracked = 0
            for m in range(ok.shape[2]):
                tracked += ok[e, n, m]
            figures.tracked[e, n] = tracked
            figures.collisions[e, n] = contacts[e, n]
            figures.is_success[e, n] = done[e]
            for k in range(weights.shape[0]):
                figures.parts[e, n, k] = weights[k] * rewards[e, n, k]
