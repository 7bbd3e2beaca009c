"""Corrections of the tilt by VQF: inputs of the horizontal bias.

VQF corrects its tilt over some seconds by its accelerometer, whose offset and lasting motion it so
takes for tilt. A horizontal bias b is gravity seen through a tilt (`attitude_coupling`), so after a
correction by (t_x, t_y) about x and y of the world it is

    b + g (t_y, -t_x)

Where these corrections are reported, only the residual gyroscope bias (`gyro_bias`) changes b
otherwise.
"""

from __future__ import annotations

from tracking.filters.joint.ekf.columns import TILT_GAIN, TILT_STEP
from tracking.filters.joint.ekf.gyro_bias import gyro_bias_transition, process_gyro_bias
from tracking.geometry import GRAVITY
from tracking.kernels.jit import small_kernel
from tracking.maths.angles import turn
from tracking.measurements import TOLD, UPRIGHT


@small_kernel
def process_tilt_correction(node, pre, i, values, e, k, is_new):
    """Note how node i was turned upright between two STATE events, the later in column k."""
    reported = node.i_acc_bias >= 0 and values[e, k, TOLD] != 0.0
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
    """Add that to the bias of node i in hypothesis h, and write it to row i of w."""
    gain0, gain1 = turn(cos_r, sin_r, pre[i, TILT_GAIN], pre[i, TILT_GAIN + 1])
    b0, b1, y = gyro_bias_transition(node, pre, x, h, i, cos_r, sin_r, w)
    w[i, TILT_STEP], w[i, TILT_STEP + 1] = gain0 + b0, gain1 + b1
    x[h, node.i_tilt_bias] += w[i, TILT_STEP]
    x[h, node.i_tilt_bias + 1] += w[i, TILT_STEP + 1]
    x[h, node.i_heading] += y


@small_kernel
def tilt_bias_tau(node):
    """How long the horizontal bias of a node stays the same [s]."""
    return node.bias_tau_with_ahrs_feedback if node.has_ahrs_feedback else node.bias_tau
