"""Initialisation of a group, and of a node that joins it, from first ranges.

A group starts with MDS on the medians of the newest ranges, once for every rotation and reflection
of the bank; the covariance covers the gap between two rotations. While all nodes rest, one rotation
represents all (`static_initialisation`). A node that joins is placed by multilateration with its
distances to the others, in every hypothesis; if those are too few or degenerate, both sides become
hypotheses.
"""

from __future__ import annotations

import math

import numpy as np

from tracking.filters.first_ranges import (
    N_FIRST,
    choose_members,
    first_shape,
    is_ready,
    start_distance,
)
from tracking.filters.joint.ekf.gauge import (
    add_rotation_uncertainty,
    add_translation_uncertainty,
    heading_functional,
)
from tracking.filters.joint.ekf.propagation import initial_tilt_variance
from tracking.filters.joint.ekf.scalar_update import reset_state
from tracking.filters.joint.hypotheses.alignment import FILTERED, LINEAR, STATIC, set_alignment
from tracking.filters.joint.hypotheses.alignment_sensitivity import has_linear_alignment
from tracking.filters.joint.hypotheses.copying import copy_hypothesis
from tracking.filters.joint.hypotheses.static_initialisation import (
    all_static,
    is_at_rest,
    is_settling,
)
from tracking.filters.joint.supervision.residuals import reset_residuals
from tracking.kernels.jit import allocating_kernel, kernel
from tracking.maths.elementary import decay
from tracking.maths.multilateration import best_positions
from tracking.models.range_bias import slow_error_var


@kernel
def can_start(c, s, layout, members, t):
    """Return the number of nodes that can start, 0 for none; write them to members."""
    m = choose_members(c, s, layout, members, t)
    return 0 if m == 0 or is_motion_unknown(c, s, members, m, t) else m


@allocating_kernel
def start(c, s, layout, t):
    """Start the group with the nodes whose pairs are all ready.

    In space its alignment is started next (`alignment_sensitivity.start_alignments`).
    """
    members = np.empty(s.nodes.shape[0], np.int64)
    m = can_start(c, s, layout, members, t)
    X = first_shape(c, s, layout, members, m)
    for a in range(m):
        s.nodes[members[a]].present = True
        reset_preintegration(s, members[a], t)
    asleep = all_static(c, s, t)
    # A smoother has room for one hypothesis; groups that it starts are not reported.
    opens = has_linear_alignment(c, s) and not asleep
    n_first = 1 if asleep or opens else min(layout.rotations.shape[0], s.alive.shape[0])
    for h in range(n_first):
        s.alive[h] = True
        s.loglik[h] = 0.0
        Y = X @ layout.rotations[h].T.copy()
        s.x[h, :] = 0.0
        s.accumulated_correction[h, :] = 0.0
        s.P[h, :, :] = 0.0
        for r in range(c.n):
            s.P[h, r, r] = 1.0
        for a in range(m):
            initialise_node(c, s, h, members[a], t)
            at, variance = s.nodes[members[a]].i_pos, c.position_var
            for b in range(m):
                if b != a:
                    _, scatter = start_distance(c, s, layout, members[a], members[b])
                    variance = max(variance, scatter * scatter)
            for k in range(c.d):
                s.x[h, at + k] = Y[a, k]
                s.P[h, at + k, at + k] = variance
        add_translation_uncertainty(c, s, h, members, m)
        add_rotation_uncertainty(c, s, h, c.rotation_var)
        for p in range(s.pairs.shape[0]):
            if s.nodes[s.pairs[p].i].present and s.nodes[s.pairs[p].j].present:
                initialise_pair(c, s, h, p, initial_nlos_prob(c, s.pairs[p]))
    for p in range(s.pairs.shape[0]):
        initialise_interval(s.pairs[p], t)
        reset_residuals(s.pairs[p])
    group = s.group[0]
    set_alignment(group, STATIC if asleep else LINEAR if opens else FILTERED)
    group.degenerate = False
    group.n_alive = n_first
    group.best, group.undecided = 0, n_first > 1
    group.t, group.t_check, group.t_constraints, group.t_gauge = t, t, t, t
    group.t_scoring_starts = t
    for a in range(m):
        if s.nodes[members[a]].sideways_var > 0.0:
            group.t_scoring_starts = t + c.wheels_after
    group.heading_gauge_var = c.rotation_var if c.d == 2 else 0.0
    group.mean_nis, group.misfit, group.misfit_limit = 1.0, 0.0, c.respawn_nis


@kernel
def is_motion_unknown(c, s, members, m, t):
    """True while a node's samples are too few to show whether it moves.

    Nodes at rest are filtered in one rotation that represents all; accelerations of moving nodes
    would be used in a wrong one.
    """
    for a in range(m):
        node = s.nodes[members[a]]
        if node.has_state and not node.static and is_settling(c, node, t):
            return True
    return False


@kernel
def initialise_interval(pair, t):
    """Initialise the mean interval of a pair that starts to run, from its first ranges."""
    n = min(pair.start_n, N_FIRST)
    first = pair.start_t[(pair.start_n - n) % N_FIRST]
    pair.interval = (t - first) / (n - 1) if n > 1 else 0.0
    pair.t_range, pair.t_used = t, t


@kernel
def reset_preintegration(s, i, t):
    """Reset the preintegrated samples of a node."""
    s.preintegrated[i, :] = 0.0
    s.nodes[i].t_pre = t


@kernel
def initialise_node(c, s, h, i, t):
    """Initialise velocity, biases, heading error and mount of node i in hypothesis h."""
    node = s.nodes[i]
    if node.static:
        return
    still = is_at_rest(c, node, t)
    # The heading error of the place where it was switched on counts less as it drives.
    drove = max(node.t_moved - node.t_first - c.orienting, 0.0)
    remaining = decay(drove / node.heading_tau)
    heading_var = node.heading_var + remaining * (node.first_heading_var - node.heading_var)
    for k in range(c.d):
        speed_var = c.rest_var if still else c.start_speed_var
        reset_state(s, h, c.n, node.i_vel + k, speed_var)
        bias_var = node.bias_var if k < 2 else node.vertical_bias_var
        if k < 2 and not still:
            bias_var += initial_tilt_variance(node, t - node.t_oriented)
        reset_state(s, h, c.n, node.i_tilt_bias + k, bias_var)
    for k in range(node.i_acc_bias, node.i_acc_bias + (3 if node.i_acc_bias >= 0 else 0)):
        reset_state(s, h, c.n, k, node.offset_var)
    reset_state(s, h, c.n, node.i_heading, heading_var)
    if node.i_mount >= 0:
        reset_state(s, h, c.n, node.i_mount, node.ahead_var)
        reset_state(s, h, c.n, node.i_mount + 1, node.slip_var)
        s.x[h, node.i_mount], s.x[h, node.i_mount + 1] = node.ahead, node.slip
    for k in range(node.i_gyro_bias, node.i_gyro_bias + (3 if node.i_gyro_bias >= 0 else 0)):
        reset_state(
            s, h, c.n, k, min(node.gyro_var, node.first_gyro_var) if node.has_ahrs_feedback else 0.0
        )


@kernel
def initial_nlos_prob(c, pair):
    """Return the NLOS probability of the first ranges of a pair, from their powers."""
    ratio = min(max(pair.start_nlos_llr, -c.first_powers_most), c.first_powers_most)
    odds = c.los_to_nlos_rate / c.nlos_to_los_rate * math.exp(ratio)
    return odds / (1.0 + odds)


@kernel
def initialise_pair(c, s, h, p, hidden):
    """Initialise the range errors of pair p, whose NLOS probability is `hidden`."""
    s.nlos[h, p], s.bias_retention[h, p] = hidden, 1.0
    at = s.pairs[p].i_range_error
    if at >= 0:
        reset_state(s, h, c.n, at, max(c.fast_var, 1e-12))
        slow_var = slow_error_var(c.slow_var, hidden, c.nlos_bias, c.nlos_bias_var)
        reset_state(s, h, c.n, at + 1, max(slow_var, 1e-12))
        s.x[h, at + 1] = hidden * c.nlos_bias


@kernel
def can_join(c, s, layout, new, ready, t):
    """Return the number of nodes that a new one is ready to join, 0 if too few; write them."""
    n = s.nodes.shape[0]
    n_present, n_ready = 0, 0
    for k in range(n):
        if s.nodes[k].present:
            n_present += 1
            if is_ready(c, s, layout, new, k, t):
                ready[n_ready] = k
                n_ready += 1
    return 0 if n_ready < min(c.d + 1, n_present) else n_ready


@allocating_kernel
def join(c, s, layout, new, t):
    """Add a node that is ready with enough of the others."""
    n = s.nodes.shape[0]
    ready = np.empty(n, np.int64)
    n_ready = can_join(c, s, layout, new, ready, t)
    sides, variance = np.empty((2, 3)), c.position_var
    known, distance = np.zeros((n_ready, 3)), np.empty(n_ready)
    was_alive = s.alive.copy()
    reset_preintegration(s, new, t)
    # The likeliest first: there may not be room for the second sides of all.
    for h in np.argsort(-s.loglik):
        if not was_alive[h]:
            continue
        for a in range(n_ready):
            at = s.nodes[ready[a]].i_pos
            for k in range(c.d):
                known[a, k] = s.x[h, at + k]
            distance[a], scatter = start_distance(c, s, layout, new, ready[a])
            variance = max(variance, scatter * scatter)
        n_sides = best_positions(c, known, distance, sides)
        for side in range(n_sides):
            target = h if side == 0 else copy_hypothesis(s, h)
            if target >= 0:
                add_node(c, s, layout, target, new, sides[side], variance, t)
    for k in range(n):
        if s.nodes[k].present:
            initialise_interval(s.pairs[layout.pair_index[new, k]], t)
    s.nodes[new].present = True


@allocating_kernel
def add_node(c, s, layout, h, new, pos, variance, t):
    """Add a node at a position, with the error of the others as a rigid body and its own.

    If the others are displaced or rotated, so is the node: ranges to it measure neither.
    """
    initialise_node(c, s, h, new, t)
    d, n = c.d, s.nodes.shape[0]
    for k in range(d):
        reset_state(s, h, c.n, s.nodes[new].i_pos + k, 0.0)
    # Error of the node from those of the others as a rigid body, one row per axis.
    J, A, present = np.zeros((d, c.n)), np.zeros(c.n), 0
    for i in range(n):
        present += s.nodes[i].present and i != new
    for k in range(d):
        for i in range(n):
            if s.nodes[i].present and i != new:
                J[k, s.nodes[i].i_pos + k] = 1.0 / present
    if d == 2:
        centre0, centre1 = heading_functional(s, h, new, A)
        J[0] -= (pos[1] - centre1) * A
        J[1] += (pos[0] - centre0) * A
    rows = J @ s.P[h]
    own = rows @ J.T.copy()
    for k in range(d):
        at = s.nodes[new].i_pos + k
        s.P[h, at, :] = rows[k]
        s.P[h, :, at] = rows[k]
        s.x[h, at] = pos[k]
        for q in range(s.sensitivity.shape[1]):
            s.sensitivity[h, q, at] = np.sum(J[k] * s.sensitivity[h, q])
    for k in range(d):
        for q in range(d):
            s.P[h, s.nodes[new].i_pos + k, s.nodes[new].i_pos + q] = own[k, q]
        s.P[h, s.nodes[new].i_pos + k, s.nodes[new].i_pos + k] += variance
    for i in range(n):
        if i != new and s.nodes[i].present:
            p = layout.pair_index[i, new]
            initialise_pair(c, s, h, p, initial_nlos_prob(c, s.pairs[p]))
            reset_residuals(s.pairs[p])
