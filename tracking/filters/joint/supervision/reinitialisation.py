"""Reinitialisation of nodes at a wrong position.

After a start or a join from few ranges a node can settle on the wrong side of the others: some of
its ranges fit, the others do not, hardly count, and it stays. Its residuals show it: steady ranges,
some too short, which no obstacle causes, some too long, and a position that fits all of them.
Errors of one sign are a wrong calibration, and those that scatter are random: both are for
`fault_detection`.

In space a node can also drift away by dead reckoning: metres off, none of its ranges fits. No
calibration errs by so much, so it joins again where there is a position for it.
"""

from __future__ import annotations

import math

import numpy as np

from tracking.filters.joint.hypotheses.bank import remove_node
from tracking.filters.joint.hypotheses.initialisation import add_node
from tracking.filters.joint.supervision.fault_detection import is_ranging
from tracking.jit import allocating_kernel, kernel, small_kernel
from tracking.maths.multilateration import SHORT, best_position, misfit, total_loss


@kernel
def find_misplaced(c, s, layout, t):
    """The node that its ranges contradict most, -1 for none, and whether it is metres off."""
    worst, most, worst_is_away = -1, c.position_misfit, False
    for i in range(s.nodes.shape[0]):
        if s.nodes[i].present:
            total, is_away = node_misfit(c, s, layout, i, t)
            if total > most:
                worst, most, worst_is_away = i, total, is_away
    return worst, worst_is_away


@kernel
def node_misfit(c, s, layout, i, t):
    """What the ranges of node i say against its place, and whether most are metres off.

    Nothing where they are too few, or all too long, or too short, as by a wrong calibration.
    """
    if s.nodes[i].static:
        return 0.0, False
    total, n, n_far, least, greatest = 0.0, 0, 0, 0.0, 0.0
    for k in range(s.nodes.shape[0]):
        if k != i and is_informative(c, s, layout, i, k, t):
            error = slow_range_error(c, s, layout.pair_index[i, k])
            total += misfit(error)
            least, greatest = min(least, error), max(greatest, error)
            n += 1
            n_far += has_large_residual(c, s.pairs[layout.pair_index[i, k]])
    # In the plane a layout that is turned the wrong way looks like it, and is found as such.
    if c.d == 3 and n >= c.d and 2 * n_far > n and least < -c.far_residual:
        return total, True
    return total if n > c.d and least < -SHORT and greatest > SHORT else 0.0, False


@small_kernel
def is_informative(c, s, layout, i, k, t):
    """True if nodes i and k range with each other, have for a while, and mean something by it."""
    p = layout.pair_index[i, k]
    pair = s.pairs[p]
    if not is_ranging(c, s, p, t) or pair.n_ranges < c.settled_ranges:
        return False
    return pair.mean_abs_residual < c.largest_scatter or has_large_residual(c, pair)


@small_kernel
def has_large_residual(c, pair):
    """True if plausible ranges have the ends of a pair metres from where they are."""
    return abs(pair.clipped_mean_residual) > c.far_residual and pair.rate_violation < c.largest_jump


@small_kernel
def slow_range_error(c, s, p):
    """By how much pair p lately ranges more than its distance [m], in the best hypothesis."""
    pair, h = s.pairs[p], s.group[0].best
    if has_large_residual(c, pair):
        at_i, at_j, squared = s.nodes[pair.i].i_pos, s.nodes[pair.j].i_pos, 0.0
        for k in range(c.d):
            squared += (s.x[h, at_j + k] - s.x[h, at_i + k]) ** 2
        return pair.last_used - math.sqrt(squared)
    error = pair.clipped_mean_residual
    if pair.i_range_error >= 0:
        error += s.x[h, pair.i_range_error] + s.x[h, pair.i_range_error + 1]
    return error


@allocating_kernel
def reinitialise_node(c, s, layout, i, is_away, t):
    """Move node i, in every hypothesis, to where its ranges fit much better, if there is such.

    One that is metres away joins again instead, on both sides of the others where that is open.
    Ranges to others that are away as well do not count; where most that move are, the group starts
    again.
    """
    n = s.nodes.shape[0]
    others, m, n_moving, n_away = np.empty(n, np.int64), 0, 0, 0
    for k in range(n):
        other_is_away = is_away and s.nodes[k].present and node_misfit(c, s, layout, k, t)[1]
        n_moving += s.nodes[k].present and not s.nodes[k].static
        n_away += other_is_away
        if k != i and not other_is_away and is_informative(c, s, layout, i, k, t):
            others[m] = k
            m += 1
    if is_away and c.n > c.n_own:
        return  # a smoother would lose the past that it holds
    if is_away and (2 * n_away > n_moving or m < c.d):
        for k in range(n):
            again = 2 * n_away > n_moving and s.nodes[k].present and not s.nodes[k].static
            if k == i or again:
                remove_node(c, s, layout, k)
        return
    known, distance, pos = np.zeros((m, 3)), np.empty(m), np.zeros(3)
    read_positions(c, s, s.group[0].best, i, others, known, pos)
    for a in range(m):
        way = np.sqrt(np.sum((known[a] - pos) ** 2))
        distance[a] = max(way + slow_range_error(c, s, layout.pair_index[i, others[a]]), 0.0)
    moved = False
    for h in range(s.alive.shape[0]):
        if s.alive[h]:
            read_positions(c, s, h, i, others, known, pos)
            before = total_loss(known, distance, pos)
            if (
                before > c.position_misfit
                and best_position(c.d, known, distance, pos) < c.position_gain * before
            ):
                if is_away:
                    remove_node(c, s, layout, i)
                    return
                add_node(c, s, layout, h, i, pos, c.position_var, t)
                moved = True
    if moved:
        s.nodes[i].outlier_ratio = 0.0


@kernel
def read_positions(c, s, h, i, others, known, pos):
    """Positions of others into known (other, 3), and of node i into pos, in hypothesis h [m]."""
    for k in range(c.d):
        pos[k] = s.x[h, s.nodes[i].i_pos + k]
        for a in range(known.shape[0]):
            known[a, k] = s.x[h, s.nodes[others[a]].i_pos + k]
