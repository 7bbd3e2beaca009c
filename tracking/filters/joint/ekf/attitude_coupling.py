"""Accelerometer offset and tilt error of a node that turns about all its axes.

An offset o turns with the body: it adds ``R(q_wb) o``, preintegrated with the accelerations. A
horizontal bias b is gravity seen through a tilt of ``(-b_y, b_x, 0) / g``, and the acceleration is
rotated by that tilt as well:

    a_measured = a + b + (b_x a_z, b_y a_z, -b_x a_x - b_y a_y) / g

Without the last term the layout is tilted as the orientations of its moving nodes are.
"""

from __future__ import annotations

from tracking.geometry import GRAVITY
from tracking.kernels.jit import small_kernel
from tracking.maths.covariance import STATES
from tracking.maths.exponentials import decay

PER_GRAVITY = 1.0 / GRAVITY
"""[s2/m] Tilt by which gravity gives a horizontal acceleration."""


@small_kernel
def corrected_increments(node, pre, x, h, i):
    """What the samples of node i add to velocity and way, as measured, its offset taken off."""
    dv0, dv1, dv2 = pre[i, 1], pre[i, 2], pre[i, 3]
    dp0, dp1, dp2 = pre[i, 4], pre[i, 5], pre[i, 6]
    if node.i_acc_bias >= 0:
        o0, o1, o2 = x[h, node.i_acc_bias], x[h, node.i_acc_bias + 1], x[h, node.i_acc_bias + 2]
        dv0 -= pre[i, 12] * o0 + pre[i, 13] * o1 + pre[i, 14] * o2
        dv1 -= pre[i, 15] * o0 + pre[i, 16] * o1 + pre[i, 17] * o2
        dv2 -= pre[i, 18] * o0 + pre[i, 19] * o1 + pre[i, 20] * o2
        dp0 -= pre[i, 21] * o0 + pre[i, 22] * o1 + pre[i, 23] * o2
        dp1 -= pre[i, 24] * o0 + pre[i, 25] * o1 + pre[i, 26] * o2
        dp2 -= pre[i, 27] * o0 + pre[i, 28] * o1 + pre[i, 29] * o2
    return dv0, dv1, dv2, dp0, dp1, dp2


@small_kernel
def write_accel_bias_jacobian(node, pre, x, h, i, cos_r, sin_r, scale, w):
    """Write to row i of w what an offset adds to velocity and way, and how much of it stays."""
    tilt0, tilt1 = PER_GRAVITY * x[h, node.i_tilt_bias], PER_GRAVITY * x[h, node.i_tilt_bias + 1]
    for at in (12, 21):
        for k in range(3):
            o0 = cos_r * pre[i, at + k] - sin_r * pre[i, at + 3 + k]
            o1 = sin_r * pre[i, at + k] + cos_r * pre[i, at + 3 + k]
            o2 = pre[i, at + 6 + k]
            w[i, at - 3 + k], w[i, at + k] = o0 - tilt0 * o2, o1 - tilt1 * o2
            w[i, at + 3 + k] = o2 + tilt0 * o0 + tilt1 * o1
    for k in range(3):
        scale[node.i_acc_bias + k] = decay(pre[i, 0] / node.offset_tau)


@small_kernel
def write_attitude_coupling(w, i, F):
    """What a node in space gains by its offset, and what its height does by a tilt, to F."""
    g, y = PER_GRAVITY, STATES - 1
    F[i, 0, 2], F[i, 1, 2], F[i, y, 2] = g * w[i, 6], -g * w[i, 5], g * w[i, 30]
    F[i, 0, 5], F[i, 1, 5], F[i, y, 5] = g * w[i, 8], -g * w[i, 7], g * w[i, 29]
    for r in range(3):
        for k in range(3):
            F[i, 3 + k, r] = -w[i, 18 + 3 * r + k]
            F[i, 3 + k, 3 + r] = -w[i, 9 + 3 * r + k]
