"""The white noise of ranges is learned while they come, where it is more than at first.

Two ranges of a pair in a row differ by how the pair has moved, which is predicted, and by the
difference of two white errors; what lasts is the same in both. Half of these differences are
smaller than 0.67 times their standard deviation, whatever a few obstacles add. So each moves the
estimate a small step up or down: the recursive median [1], from the noise of the parameters on. It
does not depend on how much of an innovation the filter takes for a lasting error.

References:
    [1] Robbins, Monro, A stochastic approximation method, Annals of Mathematical Statistics 22
        (1951) 400.
"""

from __future__ import annotations

import math

from tracking.filters.joint.hypotheses.alignment import FILTERED
from tracking.kernels.jit import small_kernel

MEDIAN = 0.6745 * math.sqrt(2.0)
"""[-] Median of the size of a difference of two white errors, over their standard deviation."""


@small_kernel
def learns_noise(c, s):
    """True where one hypothesis is left, whose residuals are those of the ranges."""
    return c.learns > 0.0 and s.group[0].alignment == FILTERED and s.group[0].n_alive == 1


@small_kernel
def learn_white_noise(c, group, pair, before, after, dt):
    """Compare a range of a pair with its last one.

    Args:
        c: Coefficients.
        group: GROUP, `white_var` updated.
        pair: PAIR, updated.
        before: By how much the range is longer than the distance predicted [m].
        after: The same of the distance as the range has corrected it [m].
        dt: Time since the last range of the pair [s].
    """
    if pair.has_residual and dt < c.white_gap:
        std = math.sqrt(group.white_var)
        is_larger = abs(before - pair.residual) > MEDIAN * std
        std *= 1.0 + (c.white_step if is_larger else -c.white_step)
        group.white_var = min(max(std * std, c.white_var), c.white_var * c.most_learned**2)
    pair.residual, pair.has_residual = after, True
