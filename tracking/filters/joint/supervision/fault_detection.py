"""Detection of faulty nodes: wrong calibrations, random ranges, nodes at a wrong pose.

Two statistics of nodes that range with two others or more, ten times a second:

    outliers   most ranges of the node do not fit, while those among the others do
    offset     the errors of all its ranges are large and of one sign: an obstacle hides a node from
               some others, a wrong calibration lengthens all of its ranges alike

The pairs of a faulty node are reported as doubtful, an offset common to its ranges becomes a state
and, with outliers, its position and velocity become uncertain. Its ranges then move the node and
the offset and hardly the others; a node at a wrong pose finds back.
"""

from __future__ import annotations

import math

from tracking.jit import kernel, small_kernel
from tracking.models.nlos import MIN_PROB


@small_kernel
def update_residual_statistics(c, s, p, dt, distance, fits, nu):
    """Count a range [m] of pair p, dt after its last [s]: fits, 1, or not, 0; nu too long [m]."""
    pair = s.pairs[p]
    if pair.n_ranges > 0:
        jump = max(abs(distance - pair.last_used) - c.fastest * dt, 0.0)
        pair.rate_violation += c.residual_gain * (min(jump, c.residual_clip) - pair.rate_violation)
    pair.last_used = distance
    pair.mean_residual += c.residual_gain * (nu - pair.mean_residual)
    off = min(max(nu - pair.clipped_mean_residual, -c.residual_clip), c.residual_clip)
    pair.clipped_mean_residual += c.residual_gain * off
    pair.mean_abs_residual += c.residual_gain * (abs(off) - pair.mean_abs_residual)
    for i in (pair.i, pair.j):
        s.nodes[i].outlier_ratio += c.outlier_gain * (1.0 - fits - s.nodes[i].outlier_ratio)


@kernel
def monitor_faults(c, s, layout, t):
    """Doubt nodes that disagree with the group."""
    group = s.group[0]
    dt = t - group.t_check
    worst = -1
    for i in range(s.nodes.shape[0]):
        node = s.nodes[i]
        if not node.present:
            node.outlier_ratio, node.faulty = 0.0, False
        elif worst < 0 or node.outlier_ratio > s.nodes[worst].outlier_ratio:
            worst = i
    blames = worst >= 0 and others_consistent(c, s, worst, t)
    for i in range(s.nodes.shape[0]):
        node = s.nodes[i]
        if not node.present:
            continue
        n, offset = common_range_error(c, s, layout, i, t)
        astray = i == worst and blames and node.outlier_ratio > c.outlier_ratio
        limit = (
            c.node_bias_limit / math.sqrt(max(n, 1)) * (c.fault_hysteresis if node.faulty else 1.0)
        )
        if n >= 2 and (astray or offset > limit):
            if not node.faulty:
                activate_node_bias(s, layout, i, c.offset_std**2)
            else:
                activate_node_bias(s, layout, i, c.offset_rate**2 * dt)
                if astray:
                    inflate_node(c, s, i, c.fault_rate**2 * dt)
            node.faulty, node.t_faulty = True, t
        elif node.faulty and t - node.t_faulty > c.fault_time:
            node.faulty = False


@kernel
def others_consistent(c, s, i, t):
    """True if there are pairs without node i, and none of them contradicts the rest."""
    n = 0
    for p in range(s.pairs.shape[0]):
        pair = s.pairs[p]
        if pair.i != i and pair.j != i and is_ranging(c, s, p, t):
            n += 1
            if pair.mean_nis > c.pair_nis_limit:
                return False
    return n > 0


@small_kernel
def is_ranging(c, s, p, t):
    """True if both nodes of pair p are there and it was ranged lately."""
    pair = s.pairs[p]
    both = s.nodes[pair.i].present and s.nodes[pair.j].present
    waits = max(c.lost_after, c.missed_intervals * pair.interval)
    return both and pair.n_ranges > 0 and t - pair.t_range < waits


@kernel
def common_range_error(c, s, layout, i, t):
    """How many others node i ranges with; the least slow error of those, 0 if signs differ [m]."""
    h, n, sign, least = s.group[0].best, 0, 0.0, math.inf
    for k in range(s.nodes.shape[0]):
        # Surveyed distances between static nodes are not of their radios.
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


@kernel
def inflate_node(c, s, i, variance):
    """Know less about where node i is and how it moves."""
    node = s.nodes[i]
    for h in range(s.alive.shape[0]):
        if s.alive[h] and not node.static:
            for k in range(c.d):
                s.P[h, node.i_pos + k, node.i_pos + k] += variance
                s.P[h, node.i_vel + k, node.i_vel + k] += variance


@kernel
def activate_node_bias(s, layout, i, variance):
    """Let the slow errors of all ranges of node i move together; none is for want of sight."""
    n = s.nodes.shape[0]
    for h in range(s.alive.shape[0]):
        if not s.alive[h]:
            continue
        for k in range(n):
            p = layout.pair_index[i, k] if k != i else -1
            if p < 0 or s.pairs[p].i_range_error < 0 or not s.nodes[k].present:
                continue
            s.nlos[h, p] = 1.0 - MIN_PROB
            for m in range(n):
                q = layout.pair_index[i, m] if m != i else -1
                if q >= 0 and s.pairs[q].i_range_error >= 0 and s.nodes[m].present:
                    s.P[h, s.pairs[p].i_range_error + 1, s.pairs[q].i_range_error + 1] += variance
