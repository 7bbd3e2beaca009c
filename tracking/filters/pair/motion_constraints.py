"""Non-holonomic constraint of cars: the rear axle moves sideways by the slip of its tyres only.

The pair filters estimate relative velocities, but a wheel constrains the velocity itself. So each
hypothesis also has the mean velocity of the group, u, dead reckoned with the mean of all
accelerations. With n the direction to the left of car i, l the distance of the tracker ahead of
the axle, k the slip, f the forward speed of the axle and w the yaw rate,

    n . v_i = (l - k f^2) w,    v_i = u + mean over k of v_ki

corrects u, and every pair of i by its own covariance: the variance of the innovation is the sum
of those of u and of the velocity in the group, so each is corrected by its share. Car i has half
of the covariance of a pair, or less if the other end is far less certain, as after a join.
"""

from __future__ import annotations

import math

from tracking.kernels.jit import small_kernel
from tracking.models.nonholonomic import nonholonomic_model


@small_kernel
def note_heading(c, node, t, q):
    """Update the yaw of a node and its low-passed rate."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    yaw = math.atan2(2.0 * (x * y + w * z), 1.0 - 2.0 * (y * y + z * z))
    dt = t - node.t_state
    if not node.has_state or dt > c.imu_timeout:
        node.yaw_rate = 0.0
    elif dt > 1e-4:
        change = yaw - node.yaw
        change -= 2.0 * math.pi * math.floor(change / (2.0 * math.pi) + 0.5)
        node.yaw_rate += dt / (c.yaw_rate_tau + dt) * (change / dt - node.yaw_rate)
    node.yaw = yaw


@small_kernel
def add_mean_velocity(c, s, i, t):
    """Integrate the acceleration of node i up to time t for the mean velocity."""
    node = s.nodes[i]
    dt = t - node.t_sum
    node.t_sum = t
    if node.has_state and 0.0 < dt < c.longest_gap:
        s.group[0].dv0 += dt * s.held[i, 4]
        s.group[0].dv1 += dt * s.held[i, 5]


@small_kernel
def velocity_in_group(s, layout, h, i, m):
    """Return the horizontal velocity of node i relative to the mean of m present nodes [m/s]."""
    v0, v1 = 0.0, 0.0
    for k in range(s.nodes.shape[0]):
        if k != i and s.nodes[k].present:
            p = layout.pair_index[i, k]
            sign = -1.0 if i < k else 1.0
            v0 += sign * s.x[p, h, 3] / m
            v1 += sign * s.x[p, h, 4] / m
    return v0, v1


@small_kernel
def apply_motion_constraints(c, s, layout, t, work):
    """Predict the mean velocity of every hypothesis and correct it with every car."""
    group = s.group[0]
    dt = t - group.t_wheels
    group.t_wheels = t
    m, psd2, any_wheels = 0, 0.0, False
    for i in range(s.nodes.shape[0]):
        node = s.nodes[i]
        if node.present:
            m += 1
            psd2 += node.psd * node.psd
            any_wheels = any_wheels or node.sideways_var > 0.0
            if not node.static:
                add_mean_velocity(c, s, i, t)
    dv0, dv1 = group.dv0 / max(m, 1), group.dv1 / max(m, 1)
    group.dv0, group.dv1 = 0.0, 0.0
    if m < 3 or not any_wheels:
        return
    q = psd2 / (m * m) * dt
    for h in range(s.alive.shape[0]):
        if not s.alive[h]:
            continue
        u, Pu = s.mean_v[h], s.mean_cov[h]
        u[0] += dv0
        u[1] += dv1
        Pu[0, 0] = min(Pu[0, 0] + q, c.group_speed_var)
        Pu[1, 1] = min(Pu[1, 1] + q, c.group_speed_var)
        for i in range(s.nodes.shape[0]):
            node = s.nodes[i]
            if node.present and node.sideways_var > 0.0 and t - node.t_state < c.imu_timeout:
                hold(c, s, layout, h, i, m, work)


@small_kernel
def hold(c, s, layout, h, i, m, work):
    """Correct hypothesis h with the non-holonomic constraint of car i."""
    node, u, Pu = s.nodes[i], s.mean_v[h], s.mean_cov[h]
    n0, n1 = -math.sin(node.yaw), math.cos(node.yaw)
    r0, r1 = velocity_in_group(s, layout, h, i, m)
    predicted, _, _, _, by_ahead, by_slip = nonholonomic_model(
        u[0] + r0, u[1] + r1, 0.0, node.ahead, node.slip, n1, -n0, node.yaw_rate, node.aside
    )
    nu = -predicted
    # Errors of the mount have no states here: they are noise.
    unknown = by_ahead * by_ahead * node.ahead_var + by_slip * by_slip * node.slip_var
    # Variance of the velocity in the group: each end has half of that of a pair.
    own = 0.0
    for k in range(s.nodes.shape[0]):
        if k != i and s.nodes[k].present:
            own += velocity_variance(s.P, layout.pair_index[i, k], h, n0, n1)
    own *= 0.5 / m
    w0, w1 = Pu[0, 0] * n0 + Pu[0, 1] * n1, Pu[1, 0] * n0 + Pu[1, 1] * n1
    common = n0 * w0 + n1 * w1
    S = common + own + node.sideways_var + unknown
    nis = nu * nu / S
    s.loglik[h] -= 0.5 * (min(nis, c.nis_cap) + math.log(S))
    if nis > c.jolt_nis:
        S *= nis / c.jolt_nis  # a jolt or a skid has less weight
    for k in range(s.nodes.shape[0]):
        if k == i or not s.nodes[k].present:
            continue
        p = layout.pair_index[i, k]
        sign = -1.0 if i < k else 1.0
        for r in range(work.shape[1]):
            work[0, r] = 0.0
        work[0, 3], work[0, 4] = sign * n0, sign * n1
        share = own_share(velocity_variance(s.P, p, h, n0, n1), own)
        correct_share(s.x, s.P, p, h, work, nu, S, share)
    g0, g1 = w0 / S, w1 / S
    u[0] += g0 * nu
    u[1] += g1 * nu
    Pu[0, 0] -= g0 * w0
    off = Pu[0, 1] - g0 * w1
    Pu[0, 1], Pu[1, 0] = off, off
    Pu[1, 1] -= g1 * w1


@small_kernel
def velocity_variance(P, p, h, n0, n1):
    """Return the variance of the velocity of pair p along the unit vector n0 n1 [m2/s2]."""
    return n0 * n0 * P[p, h, 3, 3] + n1 * n1 * P[p, h, 4, 4] + 2.0 * n0 * n1 * P[p, h, 3, 4]


@small_kernel
def own_share(pair, own):
    """Return the share of a node in the covariance of a pair: a half, or less [-].

    No covariance of two quantities is above the root of the product of their variances. So a
    node whose velocity in the group has variance `own` has a share of at most
    ``sqrt(own / pair)`` in a pair of variance `pair`: the uncertainty of a node that has just
    joined does not count as that of the others.
    """
    return 0.5 if pair <= 4.0 * own else math.sqrt(own / pair)


@small_kernel
def correct_share(x, P, p, h, work, nu, S, share):
    """Correct a pair with an innovation of variance S that concerns one of its ends.

    This end has the share a of the pair's covariance, so the gain is ``a P H / S``; the
    covariance falls by ``a^2 P H H^T P / S``, and the part of the other end stays. P stays
    positive definite as long as ``a^2 H^T P H < S``.
    """
    m = x.shape[2]
    for r in range(m):
        total = 0.0
        for k in range(3, 5):
            total += P[p, h, r, k] * work[0, k]
        work[1, r] = share * total
    for r in range(m):
        x[p, h, r] += work[1, r] * nu / S
        for k in range(r, m):
            v = P[p, h, r, k] - work[1, r] * work[1, k] / S
            P[p, h, r, k] = v
            P[p, h, k, r] = v
