"""Missing ranges: nodes that are silent, and radios that repeat one number.

**Silent.** A second without measurements leaves a moving node a metre from its estimate, two
seconds several. With a position error as large as the distance the linearisation of ranges fails:
the filter converges to a reflected or rotated layout with a small covariance. So a silent node
whose distances have become uncertain, which is called stale, joins again with its next range, and a
group of such nodes starts again. The criterion is the variance of its distances, which no rotation
of the group changes.

**Frozen.** Radios round to a millimetre or a centimetre, and some report every range twice, so a
few equal ranges are no fault; recordings that are rounded to a centimetre have runs of up to 11.
Nodes at rest may repeat one indefinitely. But noise of several centimetres does not repeat while
they move.
"""

from __future__ import annotations

import math

import numpy as np

from tracking.filters.joint.hypotheses.bank import remove_node
from tracking.filters.joint.hypotheses.static_initialisation import is_at_rest
from tracking.kernels.jit import allocating_kernel, kernel, small_kernel

SAME = 1e-5
"""[s] Ranges of one message differ in time by rounding only: they share a prediction."""


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


@small_kernel
def is_frozen(c, s, p, t, distance):
    """True if a range repeats the earlier ranges of pair p too often; counts it in any case.

    Such ranges are ignored until the number changes, also if the nodes have left by then.
    """
    pair = s.pairs[p]
    if distance != pair.last_range:
        pair.last_range, pair.t_last = distance, t
        pair.n_equal, pair.distance_travelled = 0, 0.0
        return False
    pair.n_equal += 1
    pair.distance_travelled += (t - pair.t_last) * (
        certain_speed(c, s, s.nodes[pair.i], t) + certain_speed(c, s, s.nodes[pair.j], t)
    )
    pair.t_last = t
    return pair.n_equal > c.frozen_ranges and pair.distance_travelled > c.frozen_distance


@small_kernel
def certain_speed(c, s, node, t):
    """Return the speed of a node in the best hypothesis [m/s]; 0 if it may be at rest."""
    if node.static or not node.present:
        return 0.0
    if is_at_rest(c, node, t):
        return 0.0
    h, squared = s.group[0].best, 0.0
    for k in range(c.d):
        squared += s.x[h, node.i_vel + k] ** 2
    speed = math.sqrt(squared)
    return speed if speed > c.frozen_speed else 0.0
