"""Fault handling: one action for each fault of the catalogue (`faults.CATALOGUE`).

A faulty node: an offset common to its ranges becomes a state, so its ranges correct the node and
the offset and hardly the other nodes.

A node at a wrong position: after a start or a join from few ranges a node can settle on the wrong
side of the others. Some of its ranges fit, the others hardly count, and it stays there. In space it
can also drift away by dead reckoning. It moves to where its ranges fit, or joins again.

The alignment is challenged in `hypotheses.bank.challenge`.
"""

from __future__ import annotations

import numpy as np

from tracking.filters.joint.hypotheses.bank import remove_node
from tracking.filters.joint.hypotheses.initialisation import add_node
from tracking.filters.joint.supervision.faults import (
    NONE,
    bias_ratio,
    position_misfit,
    worst_node,
)
from tracking.filters.joint.supervision.residuals import (
    is_informative,
    mean_range_error,
    node_outlier_ratio,
)
from tracking.kernels.jit import allocating_kernel, kernel
from tracking.maths.multilateration import best_position, total_loss


@kernel
def begin_node_fault(c, s, layout, i, fault, t):
    """Set the fault of node i, and activate the offset common to its ranges."""
    s.nodes[i].fault, s.nodes[i].t_fault = fault, t
    activate_node_bias(c, s, layout, i, c.offset_std**2)


@kernel
def follow_node_faults(c, s, layout, t):
    """Add process noise to the offsets of faulty nodes; end faults whose statistic has fallen."""
    dt, worst = t - s.group[0].t_check, worst_node(c, s, layout, t)
    for i in range(s.nodes.shape[0]):
        node = s.nodes[i]
        if node.fault == NONE or not node.present or node.t_fault == t:
            continue
        has_outliers = i == worst and node_outlier_ratio(c, s, layout, i, t) > c.outlier_ratio
        if has_outliers or bias_ratio(c, s, layout, i, t) > c.fault_hysteresis**2:
            activate_node_bias(c, s, layout, i, c.offset_rate**2 * dt)
            node.t_fault = t
        elif t - node.t_fault > c.fault_time:
            node.fault = NONE


@kernel
def activate_node_bias(c, s, layout, i, variance):
    """Add a common variance to the slow errors of all ranges of node i, and set them to NLOS."""
    n = s.nodes.shape[0]
    for h in range(s.alive.shape[0]):
        if not s.alive[h]:
            continue
        for k in range(n):
            p = layout.pair_index[i, k] if k != i else -1
            if p < 0 or s.pairs[p].i_range_error < 0 or not s.nodes[k].present:
                continue
            s.nlos[h, p] = 1.0 - c.least_prob
            for m in range(n):
                q = layout.pair_index[i, m] if m != i else -1
                if q >= 0 and s.pairs[q].i_range_error >= 0 and s.nodes[m].present:
                    s.P[h, s.pairs[p].i_range_error + 1, s.pairs[q].i_range_error + 1] += variance


@allocating_kernel
def reinitialise_node(c, s, layout, i, is_away, t):
    """Move node i to a position that its ranges fit much better, in each hypothesis with one.

    If it has diverged (`is_away`), it is removed and joins again, on both sides of the others if
    these are open. Ranges to others that have diverged do not count; if most moving nodes have, all
    are removed and the group starts again.

    Returns:
        True if a node was moved or removed.
    """
    n = s.nodes.shape[0]
    others, m, n_moving, n_away = np.empty(n, np.int64), 0, 0, 0
    for k in range(n):
        other_is_away = is_away and s.nodes[k].present and position_misfit(c, s, layout, k, t)[1]
        n_moving += s.nodes[k].present and not s.nodes[k].static
        n_away += other_is_away
        if k != i and not other_is_away and is_informative(c, s, layout, i, k, t):
            others[m] = k
            m += 1
    if is_away and c.n > c.n_own:
        return False  # a smoother would lose the past states in its clones
    if is_away and (2 * n_away > n_moving or m < c.d):
        for k in range(n):
            again = 2 * n_away > n_moving and s.nodes[k].present and not s.nodes[k].static
            if k == i or again:
                remove_node(c, s, layout, k)
        return True
    known, distance, pos = np.zeros((m, 3)), np.empty(m), np.zeros(3)
    read_positions(c, s, s.group[0].best, i, others, known, pos)
    for a in range(m):
        way = np.sqrt(np.sum((known[a] - pos) ** 2))
        distance[a] = max(way + mean_range_error(c, s, layout.pair_index[i, others[a]]), 0.0)
    moved = False
    for h in range(s.alive.shape[0]):
        if s.alive[h]:
            read_positions(c, s, h, i, others, known, pos)
            before = total_loss(c, known, distance, pos)
            if (
                before > c.position_misfit
                and best_position(c, known, distance, pos) < c.position_gain * before
            ):
                if is_away:
                    remove_node(c, s, layout, i)
                    return True
                add_node(c, s, layout, h, i, pos, c.position_var, t)
                moved = True
    return moved


@kernel
def read_positions(c, s, h, i, others, known, pos):
    """Write positions of others to known (other, 3), and of node i to pos, in hypothesis h [m]."""
    for k in range(c.d):
        pos[k] = s.x[h, s.nodes[i].i_pos + k]
        for a in range(known.shape[0]):
            known[a, k] = s.x[h, s.nodes[others[a]].i_pos + k]
