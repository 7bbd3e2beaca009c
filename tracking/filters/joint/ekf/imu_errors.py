"""Errors of a rotating node's IMU: tilt error, accelerometer offset, residual gyroscope bias.

**Tilt.** A horizontal bias b is gravity seen through a tilt of ``(-b_y, b_x, 0) / g``. VQF corrects
its tilt over some seconds by its accelerometer, whose offset and sustained accelerations it takes
for tilt. After a correction by (t_x, t_y) about x and y of the world the bias is

    b + g_0 (t_y, -t_x)

**Offset.** An offset o rotates with the body: it adds ``R(q_wb) o``, preintegrated with the
accelerations. The acceleration is rotated by the tilt as well:

    a_measured = a + b + (b_x a_z, b_y a_z, -b_x a_x - b_y a_y) / g

Without the last term the layout is tilted like the orientations of its moving nodes.

**Gyroscope.** VQF also removes a gyroscope bias, which it learns at rest, and in motion from its
tilt corrections. The residual g, three states in the body, rotates its orientation by
``R(q_wb) g`` a second: the tilt error changes the horizontal bias by gravity, and the heading error
grows:

    theta = S g,  b += g_0 (theta_y, -theta_x),  heading error -= theta_z,  S = int R(q_wb) dt

where g_0 is gravity; with a magnetometer the last is left out. Ranges observe g as any other state.
Every attitude event reports the bias that VQF removes: when it changes, g changes by its negative.
At rest, a reduction of its reported variance from V to V' is a measurement of g of variance
``1 / (1 / V' - 1 / V)``. Changes in motion are not used as measurements: ranges measure g better.
"""

from __future__ import annotations

from tracking.filters.joint.ekf.columns import (
    BY_GYRO,
    BY_HEADING_P,
    BY_HEADING_V,
    BY_OFFSET_P,
    BY_OFFSET_V,
    DP,
    DT,
    DV,
    GYRO_CHANGE,
    GYRO_INFORMATION,
    GYRO_SUM,
    ROTATION_P,
    ROTATION_V,
    TILT_GAIN,
    TILT_STEP,
    UP_BY_HEADING_P,
    UP_BY_HEADING_V,
    row_times,
)
from tracking.geometry import GRAVITY
from tracking.kernels.jit import small_kernel
from tracking.maths.covariance import STATES
from tracking.maths.elementary import decay, turn
from tracking.measurements import AHRS_STATUS, GYRO_BIAS, GYRO_VAR, UPRIGHT

RESTS = 2.0
"""Value of `AHRS_STATUS` at rest."""


@small_kernel
def last_state(node):
    """Return the last state of a moving node's bias, offset, heading and gyroscope bias."""
    return node.i_gyro_bias + 2 if node.i_gyro_bias >= 0 else node.i_heading


@small_kernel
def process_gyro_bias(node, pre, i, values, e, k, begins):
    """Process the gyroscope bias that a STATE event of node i reports; the first if `begins`."""
    g0, g1, g2 = values[e, k, GYRO_BIAS], values[e, k, GYRO_BIAS + 1], values[e, k, GYRO_BIAS + 2]
    var = values[e, k, GYRO_VAR]
    if not begins:
        d0, d1, d2 = g0 - node.gyro0, g1 - node.gyro1, g2 - node.gyro2
        pre[i, GYRO_CHANGE] += d0
        pre[i, GYRO_CHANGE + 1] += d1
        pre[i, GYRO_CHANGE + 2] += d2
        if values[e, k, AHRS_STATUS] == RESTS and 0.0 < var < node.gyro_var:
            gained = 1.0 / var - 1.0 / node.gyro_var
            pre[i, GYRO_INFORMATION] += gained
            pre[i, GYRO_SUM] += gained * g0 + d0 / node.gyro_var
            pre[i, GYRO_SUM + 1] += gained * g1 + d1 / node.gyro_var
            pre[i, GYRO_SUM + 2] += gained * g2 + d2 / node.gyro_var
    node.gyro0, node.gyro1, node.gyro2, node.gyro_var = g0, g1, g2, var


@small_kernel
def gyro_bias_transition(node, pre, x, h, i, cos_r, sin_r, w):
    """Apply reported changes to the gyroscope bias of node i; write derivatives to row i of w.

    Returns:
        Increments of the two biases [m/s2] and of the heading error [rad] in hypothesis h.
    """
    at, b0, b1, y = node.i_gyro_bias, 0.0, 0.0, 0.0
    for k in range(3):
        s0, s1, s2 = pre[i, ROTATION_V + k], pre[i, ROTATION_V + 3 + k], pre[i, ROTATION_V + 6 + k]
        w[i, BY_GYRO + k] = GRAVITY * (sin_r * s0 + cos_r * s1)
        w[i, BY_GYRO + 3 + k] = -GRAVITY * (cos_r * s0 - sin_r * s1)
        w[i, BY_GYRO + 6 + k] = -s2 if node.by_gyroscope else 0.0
        b0 += w[i, BY_GYRO + k] * x[h, at + k]
        b1 += w[i, BY_GYRO + 3 + k] * x[h, at + k]
        y += w[i, BY_GYRO + 6 + k] * x[h, at + k]
        x[h, at + k] -= pre[i, GYRO_CHANGE + k]
    return b0, b1, y


@small_kernel
def decay_gyro_bias_transition(node, i, w, scale):
    """Scale the transition terms of node i by the decay of the states that they act on."""
    for k in range(2):
        w[i, TILT_STEP + k] *= scale[node.i_tilt_bias + k]
    for k in range(3):
        w[i, BY_GYRO + k] *= scale[node.i_tilt_bias]
        w[i, BY_GYRO + 3 + k] *= scale[node.i_tilt_bias + 1]
        w[i, BY_GYRO + 6 + k] *= scale[node.i_heading]


@small_kernel
def propagate_gyro_bias_rows(node, P, h, i, w, scale):
    """Add gyroscope bias and heading error to the rows of biases and heading error of node i."""
    b, y, g, undo = node.i_tilt_bias, node.i_heading, node.i_gyro_bias, 1.0 / scale[node.i_heading]
    for k in range(P.shape[2]):
        g0, g1, g2, y0 = P[h, g, k], P[h, g + 1, k], P[h, g + 2, k], undo * P[h, y, k]
        b0 = row_times(w, i, BY_GYRO, g0, g1, g2)
        b1 = row_times(w, i, BY_GYRO + 3, g0, g1, g2)
        P[h, b, k] += b0 - w[i, TILT_STEP + 1] * y0
        P[h, b + 1, k] += b1 + w[i, TILT_STEP] * y0
        P[h, y, k] += row_times(w, i, BY_GYRO + 6, g0, g1, g2)


@small_kernel
def propagate_gyro_bias_columns(node, P, h, i, w, scale):
    """Add gyroscope bias and heading error to the columns of biases and heading error of node i."""
    b, y, g, undo = node.i_tilt_bias, node.i_heading, node.i_gyro_bias, 1.0 / scale[node.i_heading]
    for r in range(P.shape[2]):
        g0, g1, g2, y0 = P[h, r, g], P[h, r, g + 1], P[h, r, g + 2], undo * P[h, r, y]
        b0 = row_times(w, i, BY_GYRO, g0, g1, g2)
        b1 = row_times(w, i, BY_GYRO + 3, g0, g1, g2)
        P[h, r, b] += b0 - w[i, TILT_STEP + 1] * y0
        P[h, r, b + 1] += b1 + w[i, TILT_STEP] * y0
        P[h, r, y] += row_times(w, i, BY_GYRO + 6, g0, g1, g2)


@small_kernel
def propagate_gyro_bias_sensitivity(node, z, w, i, scale):
    """Add gyroscope bias and heading error to one row of sensitivities, from row i of the step."""
    g0, g1, g2 = z[node.i_gyro_bias], z[node.i_gyro_bias + 1], z[node.i_gyro_bias + 2]
    y0 = z[node.i_heading] / scale[node.i_heading]
    z[node.i_tilt_bias] += row_times(w, i, BY_GYRO, g0, g1, g2) - w[i, TILT_STEP + 1] * y0
    z[node.i_tilt_bias + 1] += row_times(w, i, BY_GYRO + 3, g0, g1, g2) + w[i, TILT_STEP] * y0
    z[node.i_heading] += row_times(w, i, BY_GYRO + 6, g0, g1, g2)


@small_kernel
def process_tilt_correction(node, pre, i, values, e, k, is_new):
    """Process the tilt correction of node i between two STATE events, the later in column k."""
    reported = node.i_acc_bias >= 0 and values[e, k, AHRS_STATUS] != 0.0
    if reported:
        turned0, turned1 = values[e, k, UPRIGHT], values[e, k, UPRIGHT + 1]
        begins = is_new or not node.has_ahrs_feedback
        if not begins:
            pre[i, TILT_GAIN] += GRAVITY * (turned1 - node.tilt_correction1)
            pre[i, TILT_GAIN + 1] -= GRAVITY * (turned0 - node.tilt_correction0)
        node.tilt_correction0, node.tilt_correction1 = turned0, turned1
        process_gyro_bias(node, pre, i, values, e, k, begins)
    node.has_ahrs_feedback = reported


@small_kernel
def apply_tilt_correction(node, pre, x, h, i, cos_r, sin_r, w):
    """Add tilt correction and gyroscope bias to node i in hypothesis h; write row i of w."""
    gain0, gain1 = turn(cos_r, sin_r, pre[i, TILT_GAIN], pre[i, TILT_GAIN + 1])
    b0, b1, y = gyro_bias_transition(node, pre, x, h, i, cos_r, sin_r, w)
    w[i, TILT_STEP], w[i, TILT_STEP + 1] = gain0 + b0, gain1 + b1
    x[h, node.i_tilt_bias] += w[i, TILT_STEP]
    x[h, node.i_tilt_bias + 1] += w[i, TILT_STEP + 1]
    x[h, node.i_heading] += y


@small_kernel
def tilt_bias_tau(node):
    """Return the correlation time of the horizontal bias of a node [s]."""
    return node.bias_tau_with_ahrs_feedback if node.has_ahrs_feedback else node.bias_tau


PER_GRAVITY = 1.0 / GRAVITY
"""[s2/m] Tilt per horizontal acceleration, one over gravity."""


@small_kernel
def corrected_increments(node, pre, x, h, i):
    """Return increments of velocity and position of node i as measured, without its offset."""
    dv0, dv1, dv2 = pre[i, DV], pre[i, DV + 1], pre[i, DV + 2]
    dp0, dp1, dp2 = pre[i, DP], pre[i, DP + 1], pre[i, DP + 2]
    if node.i_acc_bias >= 0:
        o0, o1, o2 = x[h, node.i_acc_bias], x[h, node.i_acc_bias + 1], x[h, node.i_acc_bias + 2]
        dv0 -= row_times(pre, i, ROTATION_V, o0, o1, o2)
        dv1 -= row_times(pre, i, ROTATION_V + 3, o0, o1, o2)
        dv2 -= row_times(pre, i, ROTATION_V + 6, o0, o1, o2)
        dp0 -= row_times(pre, i, ROTATION_P, o0, o1, o2)
        dp1 -= row_times(pre, i, ROTATION_P + 3, o0, o1, o2)
        dp2 -= row_times(pre, i, ROTATION_P + 6, o0, o1, o2)
    return dv0, dv1, dv2, dp0, dp1, dp2


@small_kernel
def write_accel_bias_jacobian(node, pre, x, h, i, cos_r, sin_r, scale, w):
    """Write derivatives of velocity and position by an offset to row i of w, and its decay."""
    tilt0, tilt1 = PER_GRAVITY * x[h, node.i_tilt_bias], PER_GRAVITY * x[h, node.i_tilt_bias + 1]
    for of, by in ((ROTATION_V, BY_OFFSET_V), (ROTATION_P, BY_OFFSET_P)):
        for k in range(3):
            o0, o1 = turn(cos_r, sin_r, pre[i, of + k], pre[i, of + 3 + k])
            o2 = pre[i, of + 6 + k]
            w[i, by + k], w[i, by + 3 + k] = o0 - tilt0 * o2, o1 - tilt1 * o2
            w[i, by + 6 + k] = o2 + tilt0 * o0 + tilt1 * o1
    for k in range(3):
        scale[node.i_acc_bias + k] = decay(pre[i, DT] / node.offset_tau)


@small_kernel
def write_attitude_coupling(w, i, F):
    """Write to F the derivatives by the offset of a node in space, and of its height by a tilt."""
    g, y = PER_GRAVITY, STATES - 1
    F[i, 0, 2], F[i, 1, 2], F[i, y, 2] = (
        g * w[i, BY_HEADING_P + 1],
        -g * w[i, BY_HEADING_P],
        g * w[i, UP_BY_HEADING_P],
    )
    F[i, 0, 5], F[i, 1, 5], F[i, y, 5] = (
        g * w[i, BY_HEADING_V + 1],
        -g * w[i, BY_HEADING_V],
        g * w[i, UP_BY_HEADING_V],
    )
    for r in range(3):
        for k in range(3):
            F[i, 3 + k, r] = -w[i, BY_OFFSET_P + 3 * r + k]
            F[i, 3 + k, 3 + r] = -w[i, BY_OFFSET_V + 3 * r + k]
