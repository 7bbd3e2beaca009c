"""Gyroscope bias by a Kalman filter over the three axes, and rest detection, [1] sec. 3.4, 3.5.

A sensor is at rest while its readings stay near their own low pass; its gyroscope then reads its
bias. In motion a bias causes a tilt that the accelerometer corrects continually: with R, the
low-passed rotation to the world,

    y = R b + v,    v ~ N(0, W)

where the horizontal parts of y are the rates of that correction. The vertical part is not
observed; zero is measured there with a large variance, so that its estimate decays slowly.

References:
    [1] Laidig, Seel, VQF, Information Fusion 91 (2023) 187.
"""

from __future__ import annotations

import math

from tracking.ahrs.lowpass import low_pass
from tracking.kernels.jit import small_kernel

GYR, ACC, REST_T, RESTING = 0, 9, 18, 19
N_REST = 20
"""Columns of the memory: the low passes of gyroscope and accelerometer, whose first three are
their last outputs [rad/s, m/s2]; time for which readings have been near [s]; 1 at rest."""


@small_kernel
def watch_gyroscope(rest, c, e, n, count, gx, gy, gz):
    """Process a gyroscope reading [rad/s], the `count`-th of node n."""
    rest[e, n, GYR], rest[e, n, GYR + 1], rest[e, n, GYR + 2] = gx, gy, gz
    low_pass(rest, e, n, GYR, 3, count, c.rest_pass, n)
    mx, my, mz = rest[e, n, GYR], rest[e, n, GYR + 1], rest[e, n, GYR + 2]
    dx, dy, dz = gx - mx, gy - my, gz - mz
    limits = c.rest[0]
    turns = max(abs(mx), abs(my), abs(mz)) > limits.largest_bias
    if turns or dx * dx + dy * dy + dz * dz >= limits.rate * limits.rate:
        rest[e, n, REST_T] = rest[e, n, RESTING] = 0.0


@small_kernel
def watch_accelerometer(rest, c, e, n, count, ax, ay, az):
    """Process an accelerometer reading [m/s2], the `count`-th of node n."""
    rest[e, n, ACC], rest[e, n, ACC + 1], rest[e, n, ACC + 2] = ax, ay, az
    low_pass(rest, e, n, ACC, 3, count, c.rest_pass, n)
    dx, dy, dz = ax - rest[e, n, ACC], ay - rest[e, n, ACC + 1], az - rest[e, n, ACC + 2]
    if dx * dx + dy * dy + dz * dz >= c.rest[0].accel * c.rest[0].accel:
        rest[e, n, REST_T] = rest[e, n, RESTING] = 0.0
    else:
        rest[e, n, REST_T] += c.dt[n]
        if rest[e, n, REST_T] >= c.rest[0].after:
            rest[e, n, RESTING] = 1.0


UNIT = 0.01 * math.pi / 180.0
"""[rad/s] Unit of the bias covariance."""

ROTATION, HORIZONTAL_RATE, BIAS, P = 0, 9, 33, 36
N_BIAS = 42
"""Columns of the memory: low passes of the rotation, row by row, and of the horizontal rates
caused by the bias [rad/s], one filter with 11 signals; the bias [rad/s]; the upper triangle of
its covariance, row by row [(0.01 deg/s)^2]."""


@small_kernel
def start_bias(bias, e, n, var):
    """Reset the low passes, keep the bias, and set its variance [(0.01 deg/s)^2]."""
    for k in range(N_BIAS):
        if k < BIAS or k >= P:
            bias[e, n, k] = 0.0
    bias[e, n, P] = bias[e, n, P + 3] = bias[e, n, P + 5] = var


@small_kernel
def worst_variance(bias, c, e, n):
    """Return a bound of the variance in the worst direction, by Gershgorin [(0.01 deg/s)^2]."""
    p01, p02 = abs(bias[e, n, P + 1]), abs(bias[e, n, P + 2])
    p12 = abs(bias[e, n, P + 4])
    rows = max(
        abs(bias[e, n, P]) + p01 + p02,
        abs(bias[e, n, P + 3]) + p01 + p12,
        abs(bias[e, n, P + 5]) + p02 + p12,
    )
    return min(rows, c.start_var[n])


@small_kernel
def mean_variance(bias, e, n):
    """Return the mean variance of the bias about an axis [(rad/s)^2]."""
    return (bias[e, n, P] + bias[e, n, P + 3] + bias[e, n, P + 5]) / 3.0 * UNIT * UNIT


@small_kernel
def clip(c, x):
    """Clip a rate to the largest bias [rad/s]."""
    largest = c.rest[0].largest_bias
    return min(max(x, -largest), largest)


@small_kernel
def estimate_bias(bias, rest, c, e, n, count, qw, qx, qy, qz, tilt_x, tilt_y):
    """Update the bias after a tilt correction.

    Args:
        bias: Memory, updated.
        rest: Memory of the rest detection.
        c: OrientationCoefficients.
        e: Environment.
        n: Node.
        count: Number of this sample, the first is 1.
        qw: 6D orientation after the correction, w.
        qx: 6D orientation after the correction, x.
        qy: 6D orientation after the correction, y.
        qz: 6D orientation after the correction, z.
        tilt_x: Horizontal part of the upward direction before the correction [-], along x.
        tilt_y: Horizontal part of the upward direction before the correction [-], along y.
    """
    b0, b1, b2 = bias[e, n, BIAS], bias[e, n, BIAS + 1], bias[e, n, BIAS + 2]
    r00, r01, r02 = 1 - 2 * (qy * qy + qz * qz), 2 * (qx * qy - qw * qz), 2 * (qw * qy + qx * qz)
    r10, r11, r12 = 2 * (qw * qz + qx * qy), 1 - 2 * (qx * qx + qz * qz), 2 * (qy * qz - qw * qx)
    r20, r21, r22 = 2 * (qx * qz - qw * qy), 2 * (qw * qx + qy * qz), 1 - 2 * (qx * qx + qy * qy)
    at = ROTATION
    bias[e, n, at], bias[e, n, at + 1], bias[e, n, at + 2] = r00, r01, r02
    bias[e, n, at + 3], bias[e, n, at + 4], bias[e, n, at + 5] = r10, r11, r12
    bias[e, n, at + 6], bias[e, n, at + 7], bias[e, n, at + 8] = r20, r21, r22
    bias[e, n, HORIZONTAL_RATE] = r00 * b0 + r01 * b1 + r02 * b2
    bias[e, n, HORIZONTAL_RATE + 1] = r10 * b0 + r11 * b1 + r12 * b2
    low_pass(bias, e, n, ROTATION, 11, count, c.tilt_pass, n)
    if rest[e, n, RESTING] != 0.0:
        r00, r01, r02 = 1.0, 0.0, 0.0
        r10, r11, r12 = 0.0, 1.0, 0.0
        r20, r21, r22 = 0.0, 0.0, 1.0
        e0 = clip(c, rest[e, n, GYR] - b0)
        e1 = clip(c, rest[e, n, GYR + 1] - b1)
        e2 = clip(c, rest[e, n, GYR + 2] - b2)
        w0 = w2 = c.rest_var[n]
    else:
        r00, r01, r02 = bias[e, n, at], bias[e, n, at + 1], bias[e, n, at + 2]
        r10, r11, r12 = bias[e, n, at + 3], bias[e, n, at + 4], bias[e, n, at + 5]
        r20, r21, r22 = bias[e, n, at + 6], bias[e, n, at + 7], bias[e, n, at + 8]
        rate = 1.0 / c.dt[n]
        e0 = clip(c, bias[e, n, HORIZONTAL_RATE] - tilt_y * rate - (r00 * b0 + r01 * b1 + r02 * b2))
        e1 = clip(
            c, bias[e, n, HORIZONTAL_RATE + 1] + tilt_x * rate - (r10 * b0 + r11 * b1 + r12 * b2)
        )
        e2 = clip(c, -(r20 * b0 + r21 * b1 + r22 * b2))
        w0, w2 = c.motion_var[n], c.vertical_var[n]

    p00, p01, p02 = bias[e, n, P], bias[e, n, P + 1], bias[e, n, P + 2]
    p11, p12, p22 = bias[e, n, P + 3], bias[e, n, P + 4], bias[e, n, P + 5]
    start_var = c.start_var[n]
    p00 += c.drift_var[n] if p00 < start_var else 0.0
    p11 += c.drift_var[n] if p11 < start_var else 0.0
    p22 += c.drift_var[n] if p22 < start_var else 0.0
    # A = R P and S = A R' + W, which W keeps well conditioned.
    a00, a01, a02 = along(r00, r01, r02, p00, p01, p02, p11, p12, p22)
    a10, a11, a12 = along(r10, r11, r12, p00, p01, p02, p11, p12, p22)
    a20, a21, a22 = along(r20, r21, r22, p00, p01, p02, p11, p12, p22)
    s00 = a00 * r00 + a01 * r01 + a02 * r02 + w0
    s01 = a00 * r10 + a01 * r11 + a02 * r12
    s02 = a00 * r20 + a01 * r21 + a02 * r22
    s11 = a10 * r10 + a11 * r11 + a12 * r12 + w0
    s12 = a10 * r20 + a11 * r21 + a12 * r22
    s22 = a20 * r20 + a21 * r21 + a22 * r22 + w2
    i00, i01, i02 = s11 * s22 - s12 * s12, s02 * s12 - s01 * s22, s01 * s12 - s02 * s11
    i11, i12, i22 = s00 * s22 - s02 * s02, s01 * s02 - s00 * s12, s00 * s11 - s01 * s01
    scale = 1.0 / (s00 * i00 + s01 * i01 + s02 * i02)
    i00, i01, i02 = scale * i00, scale * i01, scale * i02
    i11, i12, i22 = scale * i11, scale * i12, scale * i22
    # K' = S^-1 A
    k00, k10, k20 = along(a00, a10, a20, i00, i01, i02, i11, i12, i22)
    k01, k11, k21 = along(a01, a11, a21, i00, i01, i02, i11, i12, i22)
    k02, k12, k22 = along(a02, a12, a22, i00, i01, i02, i11, i12, i22)
    bias[e, n, BIAS] = clip(c, b0 + k00 * e0 + k10 * e1 + k20 * e2)
    bias[e, n, BIAS + 1] = clip(c, b1 + k01 * e0 + k11 * e1 + k21 * e2)
    bias[e, n, BIAS + 2] = clip(c, b2 + k02 * e0 + k12 * e1 + k22 * e2)
    bias[e, n, P] = p00 - (k00 * a00 + k10 * a10 + k20 * a20)
    bias[e, n, P + 1] = p01 - (k00 * a01 + k10 * a11 + k20 * a21)
    bias[e, n, P + 2] = p02 - (k00 * a02 + k10 * a12 + k20 * a22)
    bias[e, n, P + 3] = p11 - (k01 * a01 + k11 * a11 + k21 * a21)
    bias[e, n, P + 4] = p12 - (k01 * a02 + k11 * a12 + k21 * a22)
    bias[e, n, P + 5] = p22 - (k02 * a02 + k12 * a12 + k22 * a22)


@small_kernel
def along(x, y, z, m00, m01, m02, m11, m12, m22):
    """Return the product of a symmetric matrix, given by its upper triangle, and a vector."""
    return (
        m00 * x + m01 * y + m02 * z,
        m01 * x + m11 * y + m12 * z,
        m02 * x + m12 * y + m22 * z,
    )
