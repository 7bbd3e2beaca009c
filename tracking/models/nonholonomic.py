"""Non-holonomic constraint: the rear axle of a car moves sideways by the slip of its tyres only.

    l w = -sin(yaw) v_0 + cos(yaw) v_1 + k w f^2 + noise,    f = cos(yaw) v_0 + sin(yaw) v_1

with l how far the tracker is ahead of the axle, w the yaw rate, f the speed forward and k the slip:
tyres need a slip angle for the force that a curve takes, so the axle drifts outwards [1].

References:
    [1] Rajamani, Vehicle Dynamics and Control, 2nd ed., Springer 2012, section 2.3.
"""

from __future__ import annotations

from tracking.jit import small_kernel


@small_kernel
def nonholonomic_model(v0, v1, error, cos_yaw, sin_yaw, slip_rate):
    """Predict ``l w``, the sideways velocity of the axle and of its slip [m/s].

    Args:
        v0: Velocity [m/s].
        v1: Velocity [m/s].
        error: Heading error, a part of the yaw already: for derivatives alone [rad].
        cos_yaw: Cosine of the yaw.
        sin_yaw: Its sine.
        slip_rate: Slip times yaw rate [s/m].

    Returns:
        The prediction, and derivatives by v0, v1 and the heading error.
    """
    sideways, forward = -sin_yaw * v0 + cos_yaw * v1, cos_yaw * v0 + sin_yaw * v1
    outwards = slip_rate * forward
    gain = 2.0 * outwards
    d0, d1 = -sin_yaw + gain * cos_yaw, cos_yaw + gain * sin_yaw
    return sideways + outwards * forward, d0, d1, -forward + gain * sideways
