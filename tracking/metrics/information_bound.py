"""Recursion of `tracking.metrics.bound`: the joint filter's covariance along the true motion.

One row after the states is correlated with them and has no dynamics: the sum of all errors so far
along a yaw of the whole run. Corrections change its correlation with the present errors as in a
filter, which gives the variance of a sum over time.
"""

from __future__ import annotations

from tracking.filters.joint.ekf.columns import N_PRE
from tracking.filters.joint.ekf.gauge import add_rotation_uncertainty, centre
from tracking.filters.joint.ekf.preintegration import preintegrate, process_attitude
from tracking.filters.joint.ekf.propagation import predict
from tracking.filters.joint.ekf.scalar_update import compute_pht, flush_updates, kalman_update
from tracking.filters.joint.hypotheses.alignment import FILTERED, NONE, set_alignment
from tracking.filters.joint.hypotheses.initialisation import (
    initialise_node,
    initialise_pair,
    reset_preintegration,
)
from tracking.filters.joint.updates.motion_constraints import (
    constrain_nodes,
    update_gyro_bias_at_rest,
)
from tracking.filters.joint.updates.range_errors import reset_bias_on_transition
from tracking.filters.joint.updates.range_update import predict_range
from tracking.kernels.jit import kernel, small_kernel
from tracking.models.lever_arm import antenna_offset

STATE, SURVEY, RANGE = 3, 4, 5
GAUGE_PERIOD = 1.0


@kernel
def begin(c, s, t):
    """Initialise all nodes as uncertain as a first shape, with known rotation and reflection."""
    s.alive[0] = True
    for i in range(s.nodes.shape[0]):
        s.nodes[i].present = True
        reset_preintegration(s, i, t)
        initialise_node(c, s, 0, i, t)
        for k in range(c.d):
            s.P[0, s.nodes[i].i_pos + k, s.nodes[i].i_pos + k] = c.position_var
    for p in range(s.pairs.shape[0]):
        initialise_pair(c, s, 0, p, 0.0)
    group = s.group[0]
    set_alignment(group, FILTERED)
    group.n_alive = 1
    group.t, group.t_constraints, group.t_gauge = t, t, t


@small_kernel
def put_on_truth(c, s, truth, k):
    """Set the linearisation point to true positions, velocities and heading errors."""
    pos, vel, heading = truth
    s.x[0, :] = 0.0
    for i in range(s.nodes.shape[0]):
        node = s.nodes[i]
        for a in range(c.d):
            s.x[0, node.i_pos + a] = pos[k, i, a]
            if not node.static:
                s.x[0, node.i_vel + a] = vel[k, i, a]
        if not node.static:
            s.x[0, node.i_heading] = heading[k, i]
        if node.i_mount >= 0:
            s.x[0, node.i_mount], s.x[0, node.i_mount + 1] = node.ahead, node.slip


@kernel
def run_bound(coefficients, layout, s, work, block, hidden, truth, turn_var, t_out, yaw, out):
    """Propagate the covariance through the events of one environment.

    Args:
        coefficients: Constants (`make_coefficients`), (1).
        layout: Tables.
        s: JointState of one environment and one hypothesis, updated.
        work: Workspace, as that of the filter.
        block: t, kind, i, j, antenna_i, antenna_j, values of one environment, (event, ...).
        hidden: True for NLOS ranges, (event).
        truth: Positions [m], velocities [m/s], (event, node, 3), heading errors, (event, node).
        turn_var: Variance of the initial rotation of the group, about every axis [rad2].
        t_out: Times, ascending, (time) [s].
        yaw: Derivatives of the positions by a yaw of all, summed over the scored pairs,
            (time, node * d) [m].
        out: Covariance of all positions, (time, node * d, node * d), written.

    Returns:
        Variance of the sum over all times of the errors along `yaw` [m4].
    """
    t, kind, node_i, node_j, antenna_i, antenna_j, values = block
    c = coefficients[0]
    n, d = s.nodes.shape[0], c.d
    group, v = s.group[0], work.turns[0, 0]
    o, variance = 0, 0.0
    for k in range(t.shape[1]):
        what, now = kind[0, k], t[0, k]
        while o < t_out.shape[0] and t_out[o] < now:
            write_positions(s, d, n, o, out)
            variance += add_to_sum(c, s, yaw[o], v)
            o += 1
        if what == STATE:
            process_attitude(
                c, s.nodes, s.last_attitude_accel, s.preintegrated, node_i[0, k], now, values, 0, k
            )
        if what not in (RANGE, SURVEY):
            continue
        if group.alignment == NONE:
            begin(c, s, now)
            put_on_truth(c, s, truth, k)
            if turn_var > 0.0:
                add_rotation_uncertainty(c, s, 0, turn_var)
            s.P[0, c.n_own :, :], s.P[0, :, c.n_own :] = 0.0, 0.0
        if now > group.t:
            for i in range(n):
                if not s.nodes[i].static:
                    preintegrate(c, s.nodes, s.last_attitude_accel, s.preintegrated, i, now)
            predict(c, s, 0, now - group.t, work)
            for i in range(n):
                if s.nodes[i].has_ahrs_feedback:
                    update_gyro_bias_at_rest(s, 0, i, work)
            s.preintegrated[:, :N_PRE] = 0.0
            group.t = now
        put_on_truth(c, s, truth, k)
        if now - group.t_constraints >= c.constraint_period:
            constrain_nodes(c, s, 0, now, work)
            group.t_constraints = now
            put_on_truth(c, s, truth, k)
        if now - group.t_gauge >= GAUGE_PERIOD:
            centre(c, s, 0, work.w)
            group.t_gauge = now
            put_on_truth(c, s, truth, k)
        i, j, a_i, a_j = node_i[0, k], node_j[0, k], antenna_i[0, k], antenna_j[0, k]
        if i > j:
            i, j, a_i, a_j = j, i, a_j, a_i
        learn_range(c, s, layout, work, layout.pair_index[i, j], a_i, a_j, hidden[k], what)
    while o < t_out.shape[0]:
        write_positions(s, d, n, o, out)
        variance += add_to_sum(c, s, yaw[o], v)
        o += 1
    return variance


@small_kernel
def add_to_sum(c, s, yaw, v):
    """Add the present errors along a yaw to their sum; return the increase of its variance.

    Args:
        c: Coefficients.
        s: JointState of one environment.
        yaw: Derivatives of the positions, (node * d) [m].
        v: Workspace, (state).
    """
    flush_updates(s, 0)
    a, P, added = c.n_own, s.P, 0.0
    for r in range(c.n):
        v[r] = 0.0
    for i in range(s.nodes.shape[0]):
        for k in range(c.d):
            g, at = yaw[i * c.d + k], s.nodes[i].i_pos + k
            added += 2.0 * g * P[0, a, at]
            for r in range(c.n):
                v[r] += g * P[0, at, r]
    for i in range(s.nodes.shape[0]):
        for k in range(c.d):
            added += yaw[i * c.d + k] * v[s.nodes[i].i_pos + k]
    for r in range(c.n_own):
        P[0, a, r] += v[r]
        P[0, r, a] = P[0, a, r]
    P[0, a, a] += added
    return added


@small_kernel
def learn_range(c, s, layout, work, p, a_i, a_j, is_hidden, what):
    """Update the covariance by a range of pair p with known NLOS label."""
    pair = s.pairs[p]
    i0, i1, i2 = antenna_offset(s.last_attitude_accel, layout, pair.i, a_i)
    j0, j1, j2 = antenna_offset(s.last_attitude_accel, layout, pair.j, a_j)
    variance = c.survey_var
    if what == RANGE:
        was_hidden = s.nlos[0, p] > 0.5
        s.nlos[0, p] = 1.0 if is_hidden else 0.0
        if was_hidden != is_hidden:
            reset_bias_on_transition(c, s, 0, p, 1.0, c.nlos_large_share)
        variance = s.group[0].white_var + s.nlos[0, p] * c.nlos_white_var
    _, m = predict_range(c, s, 0, p, (i0, i1, i2), (j0, j1, j2), work.idx, work.val)
    S = compute_pht(s, 0, m, work) + variance
    kalman_update(s, 0, work.w, 0.0, S)


@small_kernel
def write_positions(s, d, n, o, out):
    """Write the covariance of all positions."""
    P = s.P
    flush_updates(s, 0)
    for i in range(n):
        for j in range(n):
            for a in range(d):
                for b in range(d):
                    out[o, i * d + a, j * d + b] = P[0, s.nodes[i].i_pos + a, s.nodes[j].i_pos + b]
