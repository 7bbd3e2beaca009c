"""Motion constraints: rest (velocity and gyroscope), non-holonomic vehicles, mean velocity."""

from __future__ import annotations

import math

from tracking.filters.joint.ekf.columns import GYRO_INFORMATION, GYRO_SUM
from tracking.filters.joint.ekf.scalar_update import compute_pht, covariance, kalman_update
from tracking.filters.joint.hypotheses.alignment import is_linear
from tracking.filters.joint.hypotheses.alignment_sensitivity import (
    accumulate_alignment_information,
    innovation_sensitivity,
)
from tracking.filters.joint.hypotheses.static_initialisation import is_at_rest
from tracking.kernels.jit import kernel, small_kernel
from tracking.maths.elementary import turn
from tracking.models.mean_velocity import mean_velocity_model
from tracking.models.nonholonomic import nonholonomic_model
from tracking.models.zero_velocity import zero_velocity_model


@kernel
def apply_motion_constraints(c, s, h, t, dt, work):
    """Apply the motion constraints of all nodes to hypothesis h.

    Args:
        c: Coefficients.
        s: JointState of one environment, at time t.
        h: Hypothesis.
        t: Time [s].
        dt: Time since the last motion constraints [s].
        work: Workspace.
    """
    constrain_nodes(c, s, h, t, work)
    mean_velocity_prior(c, s, h, dt, work)


@small_kernel
def constrain_nodes(c, s, h, t, work):
    """Apply ZUPTs to nodes at rest, and non-holonomic constraints to moving vehicles."""
    for r in range(c.n):
        work.x[0, r] = s.x[h, r]
    for i in range(s.nodes.shape[0]):
        node = s.nodes[i]
        if not node.present or node.static or t - node.t_state > c.imu_timeout:
            continue
        if is_at_rest(c, node, t):
            if is_known_to_move(c, s, h, i):
                if h == s.group[0].best:
                    node.t_moved = t
                continue
            for k in range(c.d):
                predicted, work.val[0] = zero_velocity_model(s.x[h, node.i_vel + k])
                work.idx[0] = node.i_vel + k
                if is_linear(s.group[0]):
                    work.direct[:] = 0.0
                apply_constraint(c, s, h, -predicted, 1, c.rest_var, work)
        elif node.sideways_var > 0.0:
            nonholonomic_constraint(c, s, h, i, work)


@small_kernel
def update_gyro_bias_at_rest(s, h, i, work):
    """Correct hypothesis h with the gyroscope bias that VQF learned at rest (`imu_errors`)."""
    node, pre = s.nodes[i], s.preintegrated
    if pre[i, GYRO_INFORMATION] == 0.0:
        return
    taken, R = (node.gyro0, node.gyro1, node.gyro2), 1.0 / pre[i, GYRO_INFORMATION]
    for k in range(3):
        work.idx[0], work.val[0] = node.i_gyro_bias + k, 1.0
        S = compute_pht(s, h, 1, work) + R
        nu = pre[i, GYRO_SUM + k] * R - taken[k] - s.x[h, node.i_gyro_bias + k]
        if is_linear(s.group[0]):
            work.direct[:] = 0.0
            innovation_sensitivity(s, h, 1, work)
            accumulate_alignment_information(s, h, work, nu, S)
        kalman_update(s, h, work.w, nu, S)


@small_kernel
def is_known_to_move(c, s, h, i):
    """True if the velocity of node i is significant although its IMU looks at rest.

    At a constant velocity, or in a slow curve, an IMU reads the same as at rest.
    """
    for k in range(c.d):
        at = s.nodes[i].i_vel + k
        v = s.x[h, at]
        floor = c.glide_nis * c.rest_var
        if v * v > floor and v * v > floor + c.glide_nis * covariance(s, h, at, at):
            return True
    return False


@small_kernel
def apply_constraint(c, s, h, nu, m, variance, work):
    """Correct hypothesis h with a constraint, and lower its likelihood by the NIS."""
    S, open_var = compute_pht(s, h, m, work) + variance, 0.0
    if is_linear(s.group[0]):
        open_var = innovation_sensitivity(s, h, m, work)
        accumulate_alignment_information(s, h, work, nu, S)
    if s.group[0].n_alive > 1:
        s.loglik[h] -= 0.5 * min(nu * nu / (S + open_var), c.nis_cap)
    kalman_update(s, h, work.w, nu, S)


@small_kernel
def nonholonomic_constraint(c, s, h, i, work):
    """Constrain the rear axle's sideways velocity to tyre slip; in space also the climb to 0."""
    node, x = s.nodes[i], work.x[0]
    error = x[node.i_heading]
    cos_e, sin_e = math.cos(error), math.sin(error)
    cos_y, sin_y = turn(cos_e, sin_e, node.cos_yaw, node.sin_yaw)
    ahead, slip, m = node.ahead, node.slip, 3
    idx, val = work.idx, work.val
    idx[0], idx[1], idx[2] = node.i_vel, node.i_vel + 1, node.i_heading
    if node.i_mount >= 0:
        ahead, slip, m = x[node.i_mount], x[node.i_mount + 1], 5
        idx[3], idx[4] = node.i_mount, node.i_mount + 1
    predicted, val[0], val[1], val[2], val[3], val[4] = nonholonomic_model(
        x[idx[0]], x[idx[1]], error, ahead, slip, cos_y, sin_y, node.yaw_rate, node.aside
    )
    nu, variance = -predicted, node.sideways_var
    if m == 3:  # the uncertainty of the mount is noise
        variance += val[3] * val[3] * node.ahead_var + val[4] * val[4] * node.slip_var
    for k in range(m):
        nu -= val[k] * (s.x[h, idx[k]] - x[idx[k]])
    if is_linear(s.group[0]):
        velocity_sensitivity(s, h, node.i_vel, val[0], val[1], 0.0, work)
    apply_constraint(c, s, h, nu, m, variance, work)
    if c.d == 3:
        idx[0], val[0] = node.i_vel + 2, 1.0
        if is_linear(s.group[0]):
            velocity_sensitivity(s, h, node.i_vel, 0.0, 0.0, 1.0, work)
        apply_constraint(c, s, h, -s.x[h, node.i_vel + 2], 1, node.sideways_var, work)


@small_kernel
def velocity_sensitivity(s, h, at, g0, g1, g2, work):
    """Write the derivatives of ``g . M^T v``, a world velocity, by the rotation M with v held."""
    for r in range(3):
        v = s.x[h, at + r]
        work.direct[3 * r], work.direct[3 * r + 1] = g0 * v, g1 * v
        work.direct[3 * r + 2] = g2 * v


@small_kernel
def mean_velocity_prior(c, s, h, dt, work):
    """Constrain the mean velocity of the moving nodes to 0, with the noise of their vehicles.

    The noise is that of one constraint a second: `dt` spreads it evenly.
    """
    m, variance = 0, 0.0
    for i in range(s.nodes.shape[0]):
        if s.nodes[i].present and not s.nodes[i].static:
            m += 1
            variance += s.nodes[i].speed_var
    if m == 0:
        return
    variance /= m * max(dt, 1e-3)
    for k in range(c.d):
        a, mean = 0, 0.0
        for i in range(s.nodes.shape[0]):
            if s.nodes[i].present and not s.nodes[i].static:
                at = s.nodes[i].i_vel + k
                part, work.val[a] = mean_velocity_model(s.x[h, at], m)
                work.idx[a] = at
                mean += part
                a += 1
        S = compute_pht(s, h, m, work) + variance
        if is_linear(s.group[0]):
            work.direct[:] = 0.0
            innovation_sensitivity(s, h, m, work)
            accumulate_alignment_information(s, h, work, -mean, S)
        kalman_update(s, h, work.w, -mean, S)
