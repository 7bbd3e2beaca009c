"""The report: relative positions, velocities and covariances of the best hypothesis."""

from __future__ import annotations

from tracking.jit import kernel
from tracking.filters._clear_kernels import clear_estimate, is_heard
from tracking.filters.joint._alignment_kernels import LINEAR, MODES, NONE, STATIC
from tracking.filters.joint._motion_kernels import predict
from tracking.filters.joint._product_kernels import take_off
from tracking.filters.joint._sample_kernels import sum_inertial
from tracking.filters.joint.state import N_PRE, JointState

# Plain numbers of `Status`: kernels do not know enums.
ABSENT, STARTING, AMBIGUOUS, OK, LOST, DOUBTFUL = 0, 1, 2, 3, 4, 5


@kernel
def write_estimate(c, s, scratch, t, e, o, out):
    """The best hypothesis at time t, without touching the state."""
    clear_estimate(e, o, out)
    pos, vel, cov, q_wb, has_q, age, nis, nlos, status = out
    group = s.group[0]
    h, d, n = group.best, c.d, s.nodes.shape[0]
    for i in range(n):
        has_q[e, o, i] = s.nodes[i].has_state
        for k in range(4):
            q_wb[e, o, i, k] = s.held[i, k]
    if group.alignment != NONE:
        look_ahead(c, s, scratch, t)
    x, P = scratch.x[0], scratch.P[0]
    for p in range(s.pairs.shape[0]):
        pair = s.pairs[p]
        node_i, node_j = s.nodes[pair.i], s.nodes[pair.j]
        nis[e, o, p] = pair.nis
        if not (node_i.present and node_j.present):
            both = is_heard(c, node_i, t) and is_heard(c, node_j, t)
            status[e, o, p] = STARTING if both else ABSENT
            continue
        nlos[e, o, p] = s.nlos[h, p]
        age[e, o, p] = t - pair.t_used
        worst = 0.0
        for k in range(d):
            pos[e, o, p, k] = x[node_j.at_p + k] - x[node_i.at_p + k]
            if not node_j.static:
                vel[e, o, p, k] += x[node_j.at_v + k]
            if not node_i.static:
                vel[e, o, p, k] -= x[node_i.at_v + k]
        for a in range(2 * d):
            for b in range(a, 2 * d):
                v = pair_covariance(P, node_i, node_j, a, b, d)
                r, q = (a if a < d else 3 + a - d), (b if b < d else 3 + b - d)
                cov[e, o, p, r, q] = v
                cov[e, o, p, q, r] = v
            if a < d:
                worst = max(worst, cov[e, o, p, a, a])
        if group.n_alive > 1 or group.alignment in (STATIC, LINEAR, MODES):
            status[e, o, p] = AMBIGUOUS
        elif node_i.static and node_j.static:
            status[e, o, p] = OK
        elif (
            age[e, o, p] > max(c.lost_after, c.missed_intervals * pair.interval) or worst > c.ok_var
        ):
            status[e, o, p] = LOST
        elif pair.misfit > c.doubt or node_i.doubted or node_j.doubted:
            status[e, o, p] = DOUBTFUL
        else:
            status[e, o, p] = OK


@kernel
def pair_covariance(P, node_i, node_j, a, b, d):
    """Covariance of two components of ``(p_j - p_i, v_j - v_i)``."""
    total = 0.0
    for one in range(2):
        node_a = node_j if one == 1 else node_i
        at_a = node_a.at_p + a if a < d else (-1 if node_a.static else node_a.at_v + a - d)
        for other in range(2):
            node_b = node_j if other == 1 else node_i
            at_b = node_b.at_p + b if b < d else (-1 if node_b.static else node_b.at_v + b - d)
            if at_a >= 0 and at_b >= 0:
                total += P[at_a, at_b] if one == other else -P[at_a, at_b]
    return total


@kernel
def look_ahead(c, s, scratch, t):
    """The states at time t, written to the scratch."""
    h, n = s.group[0].best, s.nodes.shape[0]
    for r in range(c.n):
        scratch.x[0, r] = s.x[h, r]
        for k in range(c.n):
            scratch.P[0, r, k] = s.P[h, r, k]
    take_off(scratch.P, 0, s.waiting, h, s.n_waiting[h], None)
    for i in range(n):
        for k in range(N_PRE):
            scratch.pre[i, k] = s.pre[i, k]
        scratch.t_pre[i] = s.nodes[i].t_pre
        if s.nodes[i].present and not s.nodes[i].static:
            sum_inertial(c, s.nodes, s.held, scratch.pre, i, t)
    if t > s.group[0].t:
        for p in range(s.pairs.shape[0]):
            scratch.nlos[0, p], scratch.stays[0, p] = s.nlos[h, p], s.stays[h, p]
        ahead = JointState(
            s.nodes,
            s.held,
            scratch.pre,
            s.pairs,
            s.group,
            scratch.x,
            scratch.P,
            s.waiting,
            scratch.none_waiting,
            s.moved,
            scratch.nlos,
            scratch.stays,
            s.alive,
            s.loglik,
            s.slope,
            s.score,
            s.information,
            s.spread,
        )
        predict(c, ahead, 0, t - s.group[0].t, scratch)
    for i in range(n):
        s.nodes[i].t_pre = scratch.t_pre[i]
