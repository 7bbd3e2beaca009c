"""Choice of the hypothesis of a bank that is reported."""

from __future__ import annotations

import math

from tracking.kernels.jit import kernel

LEAST_LEAD = 1e-9
"""[-] Smaller differences of log-likelihoods are rounding errors."""


@kernel
def choose_best(s, lead):
    """Report the likeliest hypothesis if it leads the reported one by more than `lead`.

    Hypotheses that start as rotated copies of one are equally likely at first. The first that
    leads by more than rounding is then reported, so that their order has no effect.

    Returns:
        The likeliest hypothesis, and whether this call chose it for the report.
    """
    group, best, second = s.group[0], -1, -math.inf
    for h in range(s.alive.shape[0]):
        if s.alive[h]:
            if best < 0 or s.loglik[h] > s.loglik[best]:
                second = s.loglik[best] if best >= 0 else second
                best = h
            else:
                second = max(second, s.loglik[h])
    if group.undecided and s.loglik[best] > second + LEAST_LEAD:
        group.undecided, lead = False, -1.0
    # A clear lead is required: hypotheses that are equally likely would alternate.
    changes = not s.alive[group.best] or s.loglik[best] > s.loglik[group.best] + lead
    if changes:
        group.best = best
    return best, changes
