"""Learning of the white noise of ranges, from the value of the parameters upwards.

Two successive ranges of a pair differ by the predicted motion of the pair and by the difference of
two white errors; lasting errors cancel. Half of these differences are smaller than 0.67 times their
standard deviation, whatever a few obstacles add. So each moves the estimate a small step up or
down: the recursive median [1]. It does not depend on the share of an innovation that the filter
assigns to a lasting error.

References:
    [1] Robbins, Monro, A stochastic approximation method, Annals of Mathematical Statistics 22
        (1951) 400.
"""

from __future__ import annotations

import math

from tracking.filters.joint.hypotheses.alignment import FILTERED
from tracking.kernels.jit import small_kernel

MEDIAN = 0.6745 * math.sqrt(2.0)
"""[-] Median absolute difference of two white errors, over the standard deviation of one."""


@small_kernel
def learns_noise(c, s):
    """True if noise is learned and one hypothesis is left, whose residuals are range errors."""
    return c.learns > 0.0 and s.group[0].alignment == FILTERED and s.group[0].n_alive == 1


@small_kernel
def learn_white_noise(c, group, pair, before, after, dt):
    """Update the white noise by the difference of a range of a pair and its last one.

    Args:
        c: Coefficients.
        group: GROUP, `white_var` updated.
        pair: PAIR, updated.
        before: Range minus predicted distance [m].
        after: Range minus distance corrected with the range [m].
        dt: Time since the last range of the pair [s].
    """
    if pair.has_residual and dt < c.white_gap:
        std = math.sqrt(group.white_var)
        is_larger = abs(before - pair.residual) > MEDIAN * std
        std *= 1.0 + (c.white_step if is_larger else -c.white_step)
        group.white_var = min(max(std * std, c.white_var), c.white_var * c.most_learned**2)
    pair.residual, pair.has_residual = after, True
