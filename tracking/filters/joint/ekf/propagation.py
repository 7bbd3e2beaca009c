"""Dead reckoning: preintegrated inertial samples are applied when a measurement comes.

With T the time since the last one, the sums ``dv = int a``, ``dp = int int a`` and, for a bias b
that rotates with the body by ``B``, ``Bv = int B``, ``Bp = int int B`` (`preintegration`) give

    p += T v + R dp - R Bp b,    v += R dv - R Bv b,    R = rotation by the heading error

exactly, for every hypothesis at once, at hardly any cost per sample. `imu_errors` has the
terms of bodies that rotate about all axes. Bias, heading error and range errors decay (first-order
Markov): the first two with time, range errors with the distance both ends travel, so that they stay
while no node moves.
"""

from __future__ import annotations

import math

from tracking.filters.joint.ekf.columns import (
    BIAS_P,
    BIAS_V,
    BY_HEADING_P,
    BY_HEADING_V,
    DT,
    NOISE,
    STEP_BIAS_P,
    STEP_BIAS_V,
    STEP_T,
    UP_BY_HEADING_P,
    UP_BY_HEADING_V,
    UP_P,
    UP_V,
)
from tracking.filters.joint.ekf.imu_errors import (
    PER_GRAVITY,
    apply_tilt_correction,
    corrected_increments,
    decay_gyro_bias_transition,
    propagate_gyro_bias_columns,
    propagate_gyro_bias_rows,
    tilt_bias_tau,
    write_accel_bias_jacobian,
    write_attitude_coupling,
)
from tracking.kernels.jit import kernel, small_kernel
from tracking.maths.covariance import STATES, add_to_columns, add_to_rows, apply_downdate, mirror
from tracking.maths.elementary import cosine_sine, decay, turn


@kernel
def predict(c, s, h, step, work):
    """Propagate hypothesis h over the preintegrated time; apply its pending updates.

    Decay comes first, in the sweep over P that applies pending updates. Derivatives that are used
    after it refer to the decayed states.

    Args:
        c: Coefficients.
        s: JointState of one environment.
        h: Hypothesis.
        step: Preintegrated time [s].
        work: Workspace: `scale`, the share of a state's error that stays; `step`, time and
            derivatives of each node; `speed`.
    """
    nodes, pairs, x, P = s.nodes, s.pairs, s.x, s.P
    scale, w, F, speed = work.scale, work.step, work.derivatives, work.speed
    d = c.d
    for r in range(P.shape[2]):
        scale[r] = 1.0
    for i in range(nodes.shape[0]):
        speed[i] = 0.0
        if moves(nodes[i]):
            propagate_state(c, nodes[i], s.preintegrated, x, h, i, scale, w, speed)
    for p in range(pairs.shape[0]):
        at = pairs[p].i_range_error
        if at < 0 or not (nodes[pairs[p].i].present and nodes[pairs[p].j].present):
            continue
        way = (speed[pairs[p].i] + speed[pairs[p].j]) * step
        scale[at] = decay(way / c.fast_length)
        hidden = s.nlos[h, p]
        scale[at + 1] = decay(way * ((1.0 - hidden) / c.slow_length + hidden / c.nlos_bias_length))
        scale[at + 1] *= s.bias_retention[h, p]  # like additional distance
        x[h, at] *= scale[at]
        x[h, at + 1] *= scale[at + 1]
        x[h, at + 1] += (1.0 - scale[at + 1]) * hidden * c.nlos_bias
    apply_downdate(P, h, s.pending_updates, h, s.n_pending[h], scale)
    s.n_pending[h] = 0
    for i in range(nodes.shape[0]):
        if moves(nodes[i]):
            write_derivatives(d, nodes[i], w, i, F, scale)
            add_to_rows(P, h, nodes[i].i_pos, nodes[i].i_tilt_bias, n_bias_states(nodes[i]), F, i)
    for i in range(nodes.shape[0]):
        if moves(nodes[i]):
            add_to_columns(
                P, h, nodes[i].i_pos, nodes[i].i_tilt_bias, n_bias_states(nodes[i]), F, i
            )
    for i in range(nodes.shape[0]):
        if moves(nodes[i]) and nodes[i].has_ahrs_feedback:
            decay_gyro_bias_transition(nodes[i], i, w, scale)
            propagate_gyro_bias_rows(nodes[i], P, h, i, w, scale)
            propagate_gyro_bias_columns(nodes[i], P, h, i, w, scale)
    mirror(P, h, c.n_motion)
    for i in range(nodes.shape[0]):
        if nodes[i].present:
            add_noise(c, nodes[i], s.preintegrated, P, h, i, scale, step)
    for p in range(pairs.shape[0]):
        at = pairs[p].i_range_error
        if at >= 0:
            slow_var = c.slow_var + s.nlos[h, p] * c.nlos_bias_var
            P[h, at, at] += (1.0 - scale[at] * scale[at]) * c.fast_var
            P[h, at + 1, at + 1] += (1.0 - scale[at + 1] * scale[at + 1]) * slow_var


@small_kernel
def propagate_state(c, node, pre, x, h, i, scale, w, speed):
    """Propagate the states of node i; write the derivatives of the step to row i of w."""
    d, T = c.d, pre[i, DT]
    p, v, b, y = node.i_pos, node.i_vel, node.i_tilt_bias, node.i_heading
    psi = x[h, y]
    cos_psi, sin_psi = cosine_sine(psi)
    cos_r, sin_r = cos_psi, sin_psi
    if node.i_acc_bias >= 0:
        write_accel_bias_jacobian(node, pre, x, h, i, cos_r, sin_r, scale, w)
    dv0, dv1, dv2, dp0, dp1, dp2 = corrected_increments(node, pre, x, h, i)
    dv0, dv1 = turn(cos_r, sin_r, dv0, dv1)
    dp0, dp1 = turn(cos_r, sin_r, dp0, dp1)
    if not node.levelled:
        cos_r, sin_r = 1.0, 0.0
    vc, vs = turn(cos_r, sin_r, pre[i, BIAS_V], pre[i, BIAS_V + 1])
    pc, ps = turn(cos_r, sin_r, pre[i, BIAS_P], pre[i, BIAS_P + 1])
    if node.i_acc_bias >= 0:
        vc, pc = vc + PER_GRAVITY * dv2, pc + PER_GRAVITY * dp2
    b0, b1 = x[h, b], x[h, b + 1]
    bv0, bv1 = vc * b0 - vs * b1, vs * b0 + vc * b1
    bp0, bp1 = pc * b0 - ps * b1, ps * b0 + pc * b1
    w[i, STEP_T], w[i, STEP_BIAS_P], w[i, STEP_BIAS_P + 1] = T, pc, ps
    w[i, STEP_BIAS_V], w[i, STEP_BIAS_V + 1] = vc, vs
    share = 1.0 if node.levelled else 0.0
    w[i, BY_HEADING_P], w[i, BY_HEADING_P + 1] = -(dp1 - share * bp1), dp0 - share * bp0
    w[i, BY_HEADING_V], w[i, BY_HEADING_V + 1] = -(dv1 - share * bv1), dv0 - share * bv0
    w[i, UP_V], w[i, UP_P] = dv2, dp2
    w[i, UP_BY_HEADING_V], w[i, UP_BY_HEADING_P] = -dv1 * b0 + dv0 * b1, -dp1 * b0 + dp0 * b1
    x[h, p] += T * x[h, v] + dp0 - bp0
    x[h, p + 1] += T * x[h, v + 1] + dp1 - bp1
    x[h, v] += dv0 - bv0
    x[h, v + 1] += dv1 - bv1
    squared = x[h, v] ** 2 + x[h, v + 1] ** 2
    if d == 3:
        x[h, p + 2] += T * x[h, v + 2] + dp2 - 0.5 * T * T * x[h, b + 2]
        x[h, v + 2] += dv2 - T * x[h, b + 2]
        if node.i_acc_bias >= 0:
            x[h, p + 2] += PER_GRAVITY * (dp0 * b0 + dp1 * b1)
            x[h, v + 2] += PER_GRAVITY * (dv0 * b0 + dv1 * b1)
        squared += x[h, v + 2] ** 2
    speed[i] = math.sqrt(squared)
    if node.has_ahrs_feedback:
        apply_tilt_correction(node, pre, x, h, i, cos_psi, sin_psi, w)
    keep = decay(T / tilt_bias_tau(node))
    scale[b], scale[b + 1] = keep, keep
    if d == 3:
        scale[b + 2] = decay(T / node.vertical_bias_tau)
    for k in range(b, y):
        x[h, k] *= scale[k]
    scale[y] = decay(T / node.heading_tau)
    x[h, y] *= scale[y]


@small_kernel
def time_since_epoch(s, i):
    """Return the preintegrated time of node i since that of the states [s]; 0 for a static node."""
    return 0.0 if s.nodes[i].static else s.preintegrated[i, DT]


@small_kernel
def displacement_since_epoch(c, s, h, i):
    """Return the displacement that `propagate_state` would add to node i, three numbers [m]."""
    node, pre, x, T = s.nodes[i], s.preintegrated, s.x, s.preintegrated[i, DT]
    psi = x[h, node.i_heading]
    cos_r, sin_r = cosine_sine(psi)
    b0, b1 = x[h, node.i_tilt_bias], x[h, node.i_tilt_bias + 1]
    _, _, _, dp0, dp1, dp2 = corrected_increments(node, pre, x, h, i)
    bp0, bp1 = pre[i, BIAS_P], pre[i, BIAS_P + 1]
    (way0, way1), way2 = turn(cos_r, sin_r, dp0, dp1), 0.0
    if node.levelled:
        bp0, bp1 = turn(cos_r, sin_r, bp0, bp1)
    if node.i_acc_bias >= 0:
        way2 = PER_GRAVITY * (way0 * b0 + way1 * b1)
        bp0 += PER_GRAVITY * dp2
    way0 += T * x[h, node.i_vel] - (bp0 * b0 - bp1 * b1)
    way1 += T * x[h, node.i_vel + 1] - (bp1 * b0 + bp0 * b1)
    if c.d == 3:
        way2 += T * x[h, node.i_vel + 2] + dp2 - 0.5 * T * T * x[h, node.i_tilt_bias + 2]
    return way0, way1, way2


@small_kernel
def moves(node):
    """True for a present node that is not static."""
    return node.present and not node.static


@small_kernel
def n_bias_states(node):
    """Return the number of a node's states from bias to heading: bias, offset, heading."""
    return node.i_heading + 1 - node.i_tilt_bias


@small_kernel
def write_derivatives(d, node, w, i, F, scale):
    """Write to F the derivatives of position and velocity of node i by its decayed other states."""
    T, pc, ps = w[i, STEP_T], w[i, STEP_BIAS_P], w[i, STEP_BIAS_P + 1]
    vc, vs = w[i, STEP_BIAS_V], w[i, STEP_BIAS_V + 1]
    y = node.i_heading - node.i_tilt_bias
    F[i, :, :] = 0.0
    F[i, STATES, :d] = T
    F[i, 0, 0], F[i, 0, 1], F[i, 0, d], F[i, 0, d + 1] = -pc, -ps, -vc, -vs
    F[i, 1, 0], F[i, 1, 1], F[i, 1, d], F[i, 1, d + 1] = ps, -pc, vs, -vc
    for k in range(2):
        F[i, y, k], F[i, y, d + k] = w[i, BY_HEADING_P + k], w[i, BY_HEADING_V + k]
    if d == 3:
        F[i, 2, 2], F[i, 2, 5] = -0.5 * T * T, -T
    if node.i_acc_bias >= 0:
        write_attitude_coupling(w, i, F)
    for q in range(y + 1):
        undo = 1.0 / scale[node.i_tilt_bias + q]
        for r in range(2 * d):
            F[i, q, r] *= undo


@small_kernel
def initial_tilt_variance(node, age):
    """Return the variance of the bias from the tilt of an orientation of this age [s]."""
    return node.initial_tilt_speed2 / (max(age, 1.0) * max(age, 1.0))


@small_kernel
def add_noise(c, node, pre, P, h, i, scale, step):
    """Add the process noise of one node: white acceleration, and noise of its Markov states."""
    p = node.i_pos
    if node.static:
        for k in range(c.d):
            P[h, p + k, p + k] += c.static_drift2 * step
        return
    v, b, y = node.i_vel, node.i_tilt_bias, node.i_heading
    T = pre[i, DT]
    q = node.psd2 * T + pre[i, NOISE]
    for k in range(c.d):
        P[h, p + k, p + k] += q * T * T / 3.0
        P[h, p + k, v + k] += 0.5 * q * T
        P[h, v + k, p + k] += 0.5 * q * T
        P[h, v + k, v + k] += q
        bias_var = node.bias_var if k < 2 else node.vertical_bias_var
        P[h, b + k, b + k] += (1.0 - scale[b + k] * scale[b + k]) * bias_var
    if node.initial_tilt_speed2 > 0.0:
        age = max(node.t_pre - node.t_oriented, 1.0)
        for k in range(2):
            P[h, b + k, b + k] += 2.0 * T / age * initial_tilt_variance(node, age)
    for k in range(node.i_acc_bias, node.i_acc_bias + (3 if node.i_acc_bias >= 0 else 0)):
        P[h, k, k] += (1.0 - scale[k] * scale[k]) * node.offset_var
    P[h, y, y] += (1.0 - scale[y] * scale[y]) * node.heading_var
    for k in range(node.i_gyro_bias, node.i_gyro_bias + (3 if node.has_ahrs_feedback else 0)):
        P[h, k, k] += node.gyro_drift2 * T
