"""Stale nodes: nodes without ranges for a while, whose distances have become uncertain.

A second without measurements leaves a moving node a metre from its estimate, two seconds several.
With a position error as large as the distance the linearisation of ranges fails: the filter
converges to a reflected or rotated layout with a small covariance. So such a node joins again with
its next range, and a group of such nodes starts again.

The criterion is the variance of its distances, which no rotation of the group changes.
"""

from __future__ import annotations

import numpy as np

from tracking.filters.joint.hypotheses.bank import remove_node
from tracking.kernels.jit import allocating_kernel, kernel, small_kernel

SAME = 1e-5
"""[s] Ranges of one message differ in time by rounding only."""


@small_kernel
def note_seen(c, node, t):
    """Set the time of a node's last range, and update its mean interval."""
    if node.seen:
        update_interval(c, node, t - node.t_last_range)
    node.seen, node.t_last_range = True, t


@small_kernel
def update_interval(c, record, dt):
    """Update the mean interval of a node or pair by a time [s]; ranges of one round count once."""
    if dt > SAME:
        record.interval += c.interval_gain * (min(dt, c.longest_interval) - record.interval)


@small_kernel
def is_silent(c, node, t):
    """True for a moving node of the group that had no range lately."""
    waits = max(c.range_timeout, c.missed_intervals * node.interval)
    return node.present and not node.static and t - node.t_last_range > waits


@allocating_kernel
def drop_stale(c, s, layout, t):
    """Remove all nodes that are silent and stale, as one of them has a range again.

    Those that remain silent would otherwise keep the others from starting again. The states are
    those of time t, and no update is pending. A smoother, which looks ahead by less than a silence
    lasts, removes none: its clones would go with the group.
    """
    if c.n > c.n_own:
        return
    faded = np.zeros(s.nodes.shape[0], np.bool_)  # for all, before the first is removed
    for i in range(s.nodes.shape[0]):
        faded[i] = is_silent(c, s.nodes[i], t) and is_stale(c, s, i)
    for i in range(s.nodes.shape[0]):
        if faded[i] and s.nodes[i].present:
            remove_node(c, s, layout, i)


@kernel
def is_stale(c, s, i):
    """True if the distances of node i to all others are uncertain, in the best hypothesis."""
    h, at = s.group[0].best, s.nodes[i].i_pos
    for k in range(s.nodes.shape[0]):
        if k == i or not s.nodes[k].present:
            continue
        other = s.nodes[k].i_pos
        squared, along = 1e-12, 0.0
        for a in range(c.d):
            off = s.x[h, other + a] - s.x[h, at + a]
            squared += off * off
            for b in range(c.d):
                across = s.P[h, at + a, other + b] + s.P[h, other + a, at + b]
                relative_covariance = s.P[h, at + a, at + b] + s.P[h, other + a, other + b] - across
                along += off * (s.x[h, other + b] - s.x[h, at + b]) * relative_covariance
        if along <= c.stale_share * c.stale_var * squared:
            return False
    return True
