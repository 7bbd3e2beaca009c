"""Accelerometer offset and tilt error of a node that rotates about all its axes.

An offset o rotates with the body: it adds ``R(q_wb) o``, preintegrated with the accelerations. A
horizontal bias b is gravity seen through a tilt of ``(-b_y, b_x, 0) / g``, and the acceleration is
rotated by that tilt as well:

    a_measured = a + b + (b_x a_z, b_y a_z, -b_x a_x - b_y a_y) / g

Without the last term the layout is tilted like the orientations of its moving nodes.
"""

from __future__ import annotations

from tracking.filters.joint.ekf.columns import (
    BY_HEADING_P,
    BY_HEADING_V,
    BY_OFFSET_P,
    BY_OFFSET_V,
    DP,
    DT,
    DV,
    ROTATION_P,
    ROTATION_V,
    UP_BY_HEADING_P,
    UP_BY_HEADING_V,
    row_times,
)
from tracking.geometry import GRAVITY
from tracking.kernels.jit import small_kernel
from tracking.maths.angles import turn
from tracking.maths.covariance import STATES
from tracking.maths.exponentials import decay

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
