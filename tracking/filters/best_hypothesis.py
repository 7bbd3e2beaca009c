"""Which hypothesis of a bank is reported."""

from __future__ import annotations

import math

from tracking.kernels.jit import kernel

LEAST_LEAD = 1e-9
"""[-] Log-likelihoods that differ by less are equal but for rounding."""


@kernel
def choose_best(s, lead):
    """Report the likeliest hypothesis if it leads the reported one by more than `lead`.

    Hypotheses that began as one in several rotations are equally likely at first. The first that
    leads by more than rounding is reported then, so that their order decides nothing.

    Returns:
        The likeliest, and whether it is reported only from now on.
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
    # Only for a clear lead, or hypotheses that are equally likely would take turns.
    changes = not s.alive[group.best] or s.loglik[best] > s.loglik[group.best] + lead
    if changes:
        group.best = best
    return best, changes
