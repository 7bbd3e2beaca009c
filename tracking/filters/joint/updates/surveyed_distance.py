"""Surveyed distances: measured once, with a tape or a total station, and valid permanently.

One that is given before both of its nodes run is used as a range at the start, and once more when
both run. It is kept while a node is away.
"""

from __future__ import annotations

from tracking.filters.joint.ekf.observability import enforce_observability
from tracking.filters.joint.ekf.scalar_update import compute_pht, kalman_update
from tracking.filters.joint.hypotheses.alignment import is_linear
from tracking.filters.joint.hypotheses.alignment_sensitivity import (
    accumulate_alignment_information,
    innovation_sensitivity,
)
from tracking.filters.joint.updates.range_update import predict_range
from tracking.kernels.jit import kernel, small_kernel


@small_kernel
def surveyed_distance_update(c, s, h, p, distance, is_news, work):
    """Correct hypothesis h with a surveyed distance between the origins of two nodes.

    The same distance again (not `is_news`) adds no information, so P stays; the states are moved,
    which removes the stretch of linear corrections since.

    A hypothesis with a newly joined node on the wrong side of the others loses likelihood by its
    next surveyed distance, long before any node moves.
    """
    if s.group[0].heading_gauge_var > c.gauge_std * c.gauge_std:
        enforce_observability(c, s, h, work)
    origin = (0.0, 0.0, 0.0)
    predicted, m = predict_range(c, s, h, p, origin, origin, work.idx, work.val)
    variance, open_var = compute_pht(s, h, m, work), 0.0
    if not is_news:
        share = (distance - predicted) / (variance + c.survey_var)
        for r in range(c.n):
            s.x[h, r] += work.w[r] * share
            s.accumulated_correction[h, r] += work.w[r] * share
        return
    if is_linear(s.group[0]):
        work.direct[:] = 0.0
        open_var = innovation_sensitivity(s, h, m, work)
        accumulate_alignment_information(s, h, work, distance - predicted, variance + c.survey_var)
    nu, S = distance - predicted, variance + c.survey_var
    nis = nu * nu / (S + open_var)
    if s.group[0].n_alive > 1 and nis > c.survey_nis:
        s.loglik[h] -= 0.5 * min(nis, c.nis_cap)
    kalman_update(s, h, work.w, nu, S)


@kernel
def apply_surveys(c, s, layout, work, i, end):
    """Correct with the surveyed distances of node i to present nodes with indices below `end`."""
    for k in range(end):
        if k != i and s.nodes[i].present and s.nodes[k].present:
            p = layout.pair_index[i, k]
            if s.pairs[p].surveyed > 0.0:
                for h in range(s.alive.shape[0]):
                    if s.alive[h]:
                        surveyed_distance_update(c, s, h, p, s.pairs[p].surveyed, True, work)
