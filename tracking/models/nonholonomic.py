"""Non-holonomic constraint: the rear axle of a car moves sideways by the slip of its tyres only.

    0 = -sin(yaw) v_0 + cos(yaw) v_1 - l w + k w f^2 + noise
    f = cos(yaw) v_0 + sin(yaw) v_1 + m w

with l the distance of the tracker ahead of the axle, m that to the left of its middle, w the yaw
rate, f the forward speed of the axle and k the slip: tyres need a slip angle for the cornering
force, so the axle drifts outwards [1].

References:
    [1] Rajamani, Vehicle Dynamics and Control, 2nd ed., Springer 2012, section 2.3.
"""

from __future__ import annotations

from tracking.kernels.jit import small_kernel


@small_kernel
def nonholonomic_model(v0, v1, error, ahead, slip, cos_yaw, sin_yaw, yaw_rate, aside):
    """Predict the sideways velocity of the axle without its slip [m/s]. The measurement is 0.

    Args:
        v0: Velocity along x [m/s].
        v1: Velocity along y [m/s].
        error: Heading error, which the yaw includes; it has a derivative only [rad].
        ahead: Distance of the tracker ahead of the axle [m].
        slip: Slip k [s2/m].
        cos_yaw: Cosine of the yaw.
        sin_yaw: Sine of the yaw.
        yaw_rate: Yaw rate [rad/s].
        aside: Distance of the tracker to the left of the middle of the axle [m].

    Returns:
        The prediction, and its derivatives by the first five arguments.
    """
    sideways, along = -sin_yaw * v0 + cos_yaw * v1, cos_yaw * v0 + sin_yaw * v1
    forward = along + aside * yaw_rate
    outwards = yaw_rate * forward * forward
    gain = 2.0 * slip * yaw_rate * forward
    d0, d1 = -sin_yaw + gain * cos_yaw, cos_yaw + gain * sin_yaw
    predicted = sideways - ahead * yaw_rate + slip * outwards
    return predicted, d0, d1, -along + gain * sideways, -yaw_rate, outwards
