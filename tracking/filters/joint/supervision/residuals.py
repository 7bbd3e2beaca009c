"""Residual statistics: running means for every pair and the group.

All are of the best hypothesis, and are reset when another becomes the best.
"""

from __future__ import annotations

import math

from tracking.kernels.jit import kernel, small_kernel


@small_kernel
def reset_residuals(pair):
    """Reset the residual statistics of a pair."""
    pair.n_ranges, pair.mean_nis, pair.outlier_ratio = 0, 1.0, 0.0
    pair.mean_residual, pair.mean_abs_residual, pair.rate_violation = 0.0, 0.0, 0.0


@small_kernel
def update_residuals(c, s, p, dt, distance, nu, misfit, sane):
    """Update the residual statistics with a range of pair p.

    Args:
        c: Coefficients.
        s: JointState of one environment.
        p: Pair.
        dt: Time since its last range [s].
        distance: Range [m].
        nu: Innovation [m].
        misfit: Squared innovation over its variance [-].
        sane: Probability that the range is no outlier.
    """
    pair, gain = s.pairs[p], c.nis_gain
    is_sane, nis = sane > c.least_sane, min(misfit, c.largest_nis)
    pair.mean_nis += gain * ((nis if is_sane else c.largest_nis) - pair.mean_nis)
    outlier = 0.0 if is_sane and misfit < c.outlier_nis else 1.0
    pair.outlier_ratio += gain * (outlier - pair.outlier_ratio)
    if s.nodes[pair.i].fault == 0 and s.nodes[pair.j].fault == 0:
        s.group[0].mean_nis += c.group_nis_gain * (sane * nis - s.group[0].mean_nis)
    gain = c.residual_gain
    if pair.n_ranges > 0:
        jump = max(abs(distance - pair.last_used) - c.fastest * dt, 0.0)
        pair.rate_violation += gain * (min(jump, c.residual_clip) - pair.rate_violation)
    pair.last_used = distance
    off = min(max(nu - pair.mean_residual, -c.residual_clip), c.residual_clip)
    pair.mean_residual += gain * off
    pair.mean_abs_residual += gain * (abs(off) - pair.mean_abs_residual)


@small_kernel
def is_ranging(c, s, p, t):
    """True if both nodes of pair p are present and it had a range lately."""
    pair = s.pairs[p]
    both = s.nodes[pair.i].present and s.nodes[pair.j].present
    waits = max(c.lost_after, c.missed_intervals * pair.interval)
    return both and pair.n_ranges > 0 and t - pair.t_range < waits


@kernel
def node_outlier_ratio(c, s, layout, i, t):
    """Return the mean outlier ratio of the pairs of node i that range [-]."""
    total, n = 0.0, 0
    for k in range(s.nodes.shape[0]):
        if k != i and is_ranging(c, s, layout.pair_index[i, k], t):
            total += s.pairs[layout.pair_index[i, k]].outlier_ratio
            n += 1
    return total / max(n, 1)


@kernel
def group_outlier_ratio(c, s, t):
    """Return the mean share of outliers over the pairs that range, without faulty nodes [-]."""
    total, n = 0.0, 0
    for p in range(s.pairs.shape[0]):
        pair = s.pairs[p]
        has_fault = s.nodes[pair.i].fault != 0 or s.nodes[pair.j].fault != 0
        if not has_fault and is_ranging(c, s, p, t):
            total += pair.outlier_ratio
            n += 1
    return total / max(n, 1)


@kernel
def others_fit(c, s, i, t):
    """True if pairs without node i range, and none of them exceeds `pair_nis_limit`."""
    n = 0
    for p in range(s.pairs.shape[0]):
        pair = s.pairs[p]
        if pair.i != i and pair.j != i and is_ranging(c, s, p, t):
            n += 1
            if pair.mean_nis > c.pair_nis_limit:
                return False
    return n > 0


@kernel
def common_range_error(c, s, layout, i, t):
    """Return how many pairs of node i range, and their least error, 0 if signs differ [m]."""
    h, n, sign, least = s.group[0].best, 0, 0.0, math.inf
    for k in range(s.nodes.shape[0]):
        # Surveyed distances between static nodes are not measured by radio.
        if k == i or (s.nodes[i].static and s.nodes[k].static):
            continue
        p = layout.pair_index[i, k]
        if not is_ranging(c, s, p, t):
            continue
        n += 1
        error = s.pairs[p].mean_residual
        if s.pairs[p].i_range_error >= 0:
            error += s.x[h, s.pairs[p].i_range_error + 1]
        if sign == 0.0:
            sign = 1.0 if error > 0.0 else -1.0
        least = min(least, sign * error)
    return n, max(least, 0.0) if n > 0 else 0.0


@small_kernel
def has_large_residual(c, pair):
    """True if the mean residual of a pair is beyond `far_residual` and its ranges are plausible."""
    return abs(pair.mean_residual) > c.far_residual and pair.rate_violation < c.largest_jump


@small_kernel
def is_informative(c, s, layout, i, k, t):
    """True if nodes i and k have had enough ranges, with little scatter or a large residual."""
    p = layout.pair_index[i, k]
    pair = s.pairs[p]
    if not is_ranging(c, s, p, t) or pair.n_ranges < c.settled_ranges:
        return False
    return pair.mean_abs_residual < c.largest_scatter or has_large_residual(c, pair)


@small_kernel
def mean_range_error(c, s, p):
    """Return the recent mean of range minus distance of pair p, in the best hypothesis [m]."""
    pair, h = s.pairs[p], s.group[0].best
    if has_large_residual(c, pair):
        at_i, at_j, squared = s.nodes[pair.i].i_pos, s.nodes[pair.j].i_pos, 0.0
        for k in range(c.d):
            squared += (s.x[h, at_j + k] - s.x[h, at_i + k]) ** 2
        return pair.last_used - math.sqrt(squared)
    error = pair.mean_residual
    if pair.i_range_error >= 0:
        error += s.x[h, pair.i_range_error] + s.x[h, pair.i_range_error + 1]
    return error
