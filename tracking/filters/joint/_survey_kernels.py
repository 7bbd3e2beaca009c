"""Surveyed distances: measured once, with a tape or a total station, and true for good.

One that is known before both of its nodes run shapes the start, which takes it for a range; so it
is used once more when they do. It is remembered while a node is away.
"""

from __future__ import annotations

from tracking.jit import kernel, small_kernel
from tracking.filters.joint._alignment_kernels import is_linear
from tracking.filters.joint._linear_kernels import absorb, project, settle_all
from tracking.filters.joint._open_kernels import tell_turn, turn_gradient
from tracking.filters.joint._range_kernels import range_model
from tracking.filters.joint._rotation_kernels import follow_rotation


@small_kernel
def fuse_survey(c, s, h, p, distance, is_news, scratch):
    """Correct hypothesis h with a surveyed distance between the origins of two nodes.

    The same distance again says nothing new, so P stays: it takes back what linear corrections
    have stretched since.

    A hypothesis that puts a newcomer on the wrong side of the others is told so by the next of
    them, long before anybody moves.
    """
    if s.group[0].turn_var > c.gauge_std * c.gauge_std:
        follow_rotation(c, s, h, scratch)
    none = scratch.none
    predicted, m = range_model(c, s, h, p, none, none, scratch.idx, scratch.val)
    variance, open_var = project(s, h, m, scratch), 0.0
    if not is_news:
        share = (distance - predicted) / (variance + c.survey_var)
        for r in range(c.n):
            s.x[h, r] += scratch.w[r] * share
            s.moved[h, r] += scratch.w[r] * share
        return
    if is_linear(s.group[0]):
        scratch.direct[:] = 0.0
        open_var = turn_gradient(s, h, m, scratch)
        tell_turn(s, h, scratch, distance - predicted, variance + c.survey_var)
    nu, S = distance - predicted, variance + c.survey_var
    nis = nu * nu / (S + open_var)
    if s.group[0].n_alive > 1 and nis > c.survey_nis:
        s.loglik[h] -= 0.5 * min(nis, c.max_nis)
    absorb(s, h, scratch.w, nu, S)


@kernel
def use_surveys(c, s, layout, scratch, i, end):
    """Correct with the surveyed distances of node i to those before `end` that are there."""
    for k in range(end):
        if k != i and s.nodes[i].present and s.nodes[k].present:
            p = layout.pair_index[i, k]
            if s.pairs[p].surveyed > 0.0:
                for h in range(s.alive.shape[0]):
                    if s.alive[h]:
                        fuse_survey(c, s, h, p, s.pairs[p].surveyed, True, scratch)
    settle_all(s)
