"""Estimates: relative positions, velocities and covariances of the best hypothesis."""

from __future__ import annotations

from tracking.filters.clear_estimate import clear_estimate, has_recent_range
from tracking.filters.joint.ekf.columns import N_PRE
from tracking.filters.joint.ekf.preintegration import preintegrate
from tracking.filters.joint.ekf.propagation import predict
from tracking.filters.joint.hypotheses.alignment import LINEAR, MODES, NONE, STATIC
from tracking.filters.joint.state import JointState
from tracking.filters.joint.supervision.residuals import group_outlier_ratio
from tracking.kernels.addresses import by_reference
from tracking.kernels.jit import kernel, small_kernel
from tracking.maths.covariance import apply_downdate

# Plain numbers of `Status`: kernels do not know enums.
ABSENT, STARTING, AMBIGUOUS, OK, LOST, DOUBTFUL = 0, 1, 2, 3, 4, 5


@kernel
def write_estimate(c, s, work, t, e, o, out):
    """Write the estimate of the best hypothesis at time t; the state does not change."""
    clear_estimate(e, o, out)
    pos, vel, cov, q_wb, has_q, age, nis, nlos, status = out
    group = s.group[0]
    h, d, n = group.best, c.d, s.nodes.shape[0]
    for i in range(n):
        has_q[e, o, i] = s.nodes[i].has_state
        for k in range(4):
            q_wb[e, o, i, k] = s.last_attitude_accel[i, k]
    if group.alignment != NONE:
        predict_estimate(c, s, work, t)
    x, P = work.x[0], work.P[0]
    few_see, some_never_saw = who_sees(c, s, t)
    is_open = group.n_alive > 1 or group.alignment in (STATIC, LINEAR, MODES)
    is_group_doubtful = group_outlier_ratio(c, s, t) > c.group_outlier_ratio
    for p in range(s.pairs.shape[0]):
        pair = s.pairs[p]
        node_i, node_j = s.nodes[pair.i], s.nodes[pair.j]
        nis[e, o, p] = pair.nis
        if not (node_i.present and node_j.present):
            both = has_recent_range(c, node_i, t) and has_recent_range(c, node_j, t)
            status[e, o, p] = STARTING if both else ABSENT
            continue
        nlos[e, o, p] = s.nlos[h, p]
        age[e, o, p] = t - pair.t_used
        squared_error = 0.0
        for k in range(d):
            pos[e, o, p, k] = x[node_j.i_pos + k] - x[node_i.i_pos + k]
            if not node_j.static:
                vel[e, o, p, k] += x[node_j.i_vel + k]
            if not node_i.static:
                vel[e, o, p, k] -= x[node_i.i_vel + k]
        for a in range(2 * d):
            for b in range(a, 2 * d):
                v = pair_covariance(P, node_i, node_j, a, b, d)
                r, q = (a if a < d else 3 + a - d), (b if b < d else 3 + b - d)
                cov[e, o, p, r, q] = v
                cov[e, o, p, q, r] = v
            if a < d:
                squared_error += cov[e, o, p, a, a]
        is_blind_pair = some_never_saw or is_blind(c, node_i, t) or is_blind(c, node_j, t)
        if is_open or (few_see and is_blind_pair):
            status[e, o, p] = AMBIGUOUS
        elif is_silent_pair(c, pair, node_i, node_j, age[e, o, p]):
            status[e, o, p] = LOST
        elif (
            is_group_doubtful
            or pair.mean_nis > c.pair_nis_limit
            or node_i.fault != 0
            or node_j.fault != 0
        ):
            status[e, o, p] = DOUBTFUL
        elif squared_error > accuracy_of(node_i, node_j) ** 2:
            status[e, o, p] = LOST
        else:
            status[e, o, p] = OK


@small_kernel
def is_silent_pair(c, pair, node_i, node_j, age):
    """True if a pair had no range lately; static nodes need none of each other."""
    is_fixed = node_i.static and node_j.static
    return not is_fixed and age > max(c.lost_after, c.missed_intervals * pair.interval)


@small_kernel
def accuracy_of(node_i, node_j):
    """Return the expected error up to which a pair is ok [m]; moving nodes decide it."""
    if node_i.static != node_j.static:
        return node_j.accuracy if node_i.static else node_i.accuracy
    return max(node_i.accuracy, node_j.accuracy)


@small_kernel
def is_blind(c, node, t):
    """True for a moving node without IMU samples for a while."""
    return not node.static and (not node.has_state or t - node.t_state > c.blind_after)


@small_kernel
def who_sees(c, s, t):
    """Return whether too few nodes have an IMU or are static, and whether a moving one never had.

    The motion of a node without an IMU is modelled as white acceleration, which does not tell a
    path from its mirror image. Distances to more other nodes than dimensions do. A group that
    started with such a node may be turned wrongly as a whole.
    """
    n_seeing, some_never = 0, False
    for i in range(s.nodes.shape[0]):
        node = s.nodes[i]
        if node.present:
            some_never |= not (node.static or node.has_state)
            n_seeing += 0 if is_blind(c, node, t) else 1
    return n_seeing <= c.d, some_never


@kernel
def pair_covariance(P, node_i, node_j, a, b, d):
    """Return the covariance of two components of ``(p_j - p_i, v_j - v_i)``."""
    total = 0.0
    for one in range(2):
        node_a = node_j if one == 1 else node_i
        at_a = node_a.i_pos + a if a < d else (-1 if node_a.static else node_a.i_vel + a - d)
        for other in range(2):
            node_b = node_j if other == 1 else node_i
            at_b = node_b.i_pos + b if b < d else (-1 if node_b.static else node_b.i_vel + b - d)
            if at_a >= 0 and at_b >= 0:
                total += P[at_a, at_b] if one == other else -P[at_a, at_b]
    return total


@kernel
def predict_estimate(c, s, work, t):
    """Write the states at time t to the workspace."""
    h, n = s.group[0].best, s.nodes.shape[0]
    for r in range(c.n):
        work.x[0, r] = s.x[h, r]
        for k in range(c.n):
            work.P[0, r, k] = s.P[h, r, k]
    apply_downdate(work.P, 0, s.pending_updates, h, s.n_pending[h], None)
    for i in range(n):
        for k in range(N_PRE):
            work.preintegrated[i, k] = s.preintegrated[i, k]
        work.t_pre[i] = s.nodes[i].t_pre
        if s.nodes[i].present and not s.nodes[i].static:
            preintegrate(c, s.nodes, s.last_attitude_accel, work.preintegrated, i, t)
    if t > s.group[0].t:
        for p in range(s.pairs.shape[0]):
            work.nlos[0, p], work.bias_retention[0, p] = s.nlos[h, p], s.bias_retention[h, p]
        ahead = JointState(
            s.nodes,
            s.last_attitude_accel,
            work.preintegrated,
            s.pairs,
            s.group,
            work.x,
            work.P,
            s.pending_updates,
            work.none_waiting,
            s.accumulated_correction,
            work.nlos,
            work.bias_retention,
            s.alive,
            s.loglik,
            s.sensitivity,
            s.alignment_score,
            s.alignment_information,
            s.alignment_cov,
        )
        predict(c, by_reference(ahead), 0, t - s.group[0].t, work)
    for i in range(n):
        s.nodes[i].t_pre = work.t_pre[i]
