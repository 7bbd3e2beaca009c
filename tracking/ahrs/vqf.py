"""VQF [1]: the orientation of a sensor from its gyroscope, accelerometer and magnetometer.

Three rotations are kept separate. The gyroscope alone is integrated to an orientation in a frame
that turns slowly, with its bias. In that frame the specific force is low-passed, which leaves
gravity, and the second rotation makes it vertical. The third, about the vertical, is from the
magnetometer.

    q_6d = q_acc q_gyr,    q_9d = Rz(delta) q_6d

All parameters except the two time constants are the defaults of [1].

References:
    [1] Laidig, Seel, VQF: Highly accurate IMU orientation estimation with bias estimation and
        magnetic disturbance rejection, Information Fusion 91 (2023) 187.
"""

from __future__ import annotations

import math

from tracking.ahrs.gyro_bias import (
    BIAS,
    GYR,
    N_REST,
    RESTING,
    estimate_bias,
    start_bias,
    watch_accelerometer,
    watch_gyroscope,
)
from tracking.ahrs.lowpass import low_pass
from tracking.ahrs.magnetometer import COS, SIN, correct_heading, start_magnetic
from tracking.kernels.jit import kernel, small_kernel
from tracking.maths.elementary import SERIES, small_turn

Q_GYR, Q_ACC, Q_6D, FORCE, N_GYR_READ, N_ACC_READ = 0, 4, 8, 12, 21, 22
TURN = 23
N_TILT = 25
"""Columns of the memory: the rotations; low pass of the specific force in the frame of the
gyroscope; numbers of readings; tilt correction since it was last reported, about x and y [rad]."""


@small_kernel
def start_vqf(s, c, e, n, var):
    """Reset everything but the gyroscope bias, which gets a variance [(0.01 deg/s)^2]."""
    for k in range(N_TILT):
        s.tilt[e, n, k] = 0.0
    for k in range(N_REST):
        s.rest[e, n, k] = 0.0
    s.tilt[e, n, Q_GYR] = s.tilt[e, n, Q_ACC] = s.tilt[e, n, Q_6D] = 1.0
    start_bias(s.bias, e, n, var)
    start_magnetic(s.magnetic, c, e, n)


@small_kernel
def multiply(aw, ax, ay, az, bw, bx, by, bz):
    """Return the Hamilton product a b."""
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )


@small_kernel
def turned(qw, qx, qy, qz, x, y, z):
    """Return R(q) v."""
    tx, ty, tz = 2 * (qy * z - qz * y), 2 * (qz * x - qx * z), 2 * (qx * y - qy * x)
    return (
        x + qw * tx + qy * tz - qz * ty,
        y + qw * ty + qz * tx - qx * tz,
        z + qw * tz + qx * ty - qy * tx,
    )


@small_kernel
def store_unit(q, e, n, at, w, x, y, z):
    """Write a quaternion with its length normalised, which differs from 1 by rounding only.

    One Newton step for the inverse root: the remaining error is of second order.
    """
    scale = 1.5 - 0.5 * (w * w + x * x + y * y + z * z)
    q[e, n, at], q[e, n, at + 1] = scale * w, scale * x
    q[e, n, at + 2], q[e, n, at + 3] = scale * y, scale * z


@small_kernel
def integrate(s, c, e, n, dt, gx, gy, gz):
    """Process a gyroscope reading [rad/s] over dt [s]: rest detection, then strapdown."""
    q = s.tilt
    q[e, n, N_GYR_READ] += 1.0
    watch_gyroscope(s.rest, c, e, n, q[e, n, N_GYR_READ], gx, gy, gz)
    half = 0.5 * dt
    x = half * (gx - s.bias[e, n, BIAS])
    y = half * (gy - s.bias[e, n, BIAS + 1])
    z = half * (gz - s.bias[e, n, BIAS + 2])
    square = x * x + y * y + z * z
    if square < SERIES:
        cosine, sine = small_turn(square)
    else:
        angle = math.sqrt(square)
        cosine, sine = math.cos(angle), math.sin(angle) / angle
    w, x, y, z = multiply(
        q[e, n, Q_GYR], q[e, n, Q_GYR + 1], q[e, n, Q_GYR + 2], q[e, n, Q_GYR + 3],
        cosine, sine * x, sine * y, sine * z,
    )  # fmt: skip
    store_unit(q, e, n, Q_GYR, w, x, y, z)


@small_kernel
def store_6d(q, e, n):
    """Store the product of the two rotations, the orientation without a magnetometer."""
    q[e, n, Q_6D], q[e, n, Q_6D + 1], q[e, n, Q_6D + 2], q[e, n, Q_6D + 3] = multiply(
        q[e, n, Q_ACC], q[e, n, Q_ACC + 1], q[e, n, Q_ACC + 2], q[e, n, Q_ACC + 3],
        q[e, n, Q_GYR], q[e, n, Q_GYR + 1], q[e, n, Q_GYR + 2], q[e, n, Q_GYR + 3],
    )  # fmt: skip


@small_kernel
def correct_tilt(s, c, e, n, ax, ay, az):
    """Process an accelerometer reading [m/s2], not all zero: rest, tilt, bias."""
    q = s.tilt
    q[e, n, N_ACC_READ] += 1.0
    count = q[e, n, N_ACC_READ]
    watch_accelerometer(s.rest, c, e, n, count, ax, ay, az)
    q[e, n, FORCE], q[e, n, FORCE + 1], q[e, n, FORCE + 2] = turned(
        q[e, n, Q_GYR], q[e, n, Q_GYR + 1], q[e, n, Q_GYR + 2], q[e, n, Q_GYR + 3], ax, ay, az
    )
    low_pass(q, e, n, FORCE, 3, count, c.tilt_pass, n)
    aw, bx, by, bz = q[e, n, Q_ACC], q[e, n, Q_ACC + 1], q[e, n, Q_ACC + 2], q[e, n, Q_ACC + 3]
    ux, uy, uz = turned(aw, bx, by, bz, q[e, n, FORCE], q[e, n, FORCE + 1], q[e, n, FORCE + 2])
    length = math.sqrt(ux * ux + uy * uy + uz * uz)
    if length > 0.0:
        scale = 1.0 / length
        ux, uy, uz = scale * ux, scale * uy, scale * uz
    else:
        ux, uy, uz = 0.0, 0.0, 1.0  # no information
    # The shortest rotation that makes (ux, uy, uz) vertical; for 180 degrees, one of several.
    half = math.sqrt(max(0.5 * (uz + 1.0), 0.0))
    cw, cx, cy = 0.0, 1.0, 0.0
    if half > 1e-6:
        cw, cx, cy = half, 0.5 * uy / half, -0.5 * ux / half
    q[e, n, TURN] += 2.0 * cx
    q[e, n, TURN + 1] += 2.0 * cy
    w, x, y, z = multiply(cw, cx, cy, 0.0, aw, bx, by, bz)
    store_unit(q, e, n, Q_ACC, w, x, y, z)
    store_6d(q, e, n)
    estimate_bias(
        s.bias, s.rest, c, e, n, count,
        q[e, n, Q_6D], q[e, n, Q_6D + 1], q[e, n, Q_6D + 2], q[e, n, Q_6D + 3], ux, uy,
    )  # fmt: skip


@small_kernel
def update_vqf(s, c, e, n, dt, gx, gy, gz, ax, ay, az):
    """Process an inertial sample of node n; an accelerometer that reads zero corrects no tilt.

    Low passes count samples.

    Args:
        s: OrientationState, its memories `tilt`, `rest` and `bias` updated.
        c: OrientationCoefficients.
        e: Environment.
        n: Node.
        dt: Integration time of the gyroscope [s].
        gx: Gyroscope, body frame [rad/s], along x.
        gy: Gyroscope, body frame [rad/s], along y.
        gz: Gyroscope, body frame [rad/s], along z.
        ax: Specific force, body frame [m/s2], along x.
        ay: Specific force, body frame [m/s2], along y.
        az: Specific force, body frame [m/s2], along z.
    """
    integrate(s, c, e, n, dt, gx, gy, gz)
    if ax != 0.0 or ay != 0.0 or az != 0.0:
        correct_tilt(s, c, e, n, ax, ay, az)
    else:
        store_6d(s.tilt, e, n)


@small_kernel
def update_heading(s, c, e, n, mx, my, mz):
    """Process a magnetic field, body frame, any unit, after the inertial sample; zero is none."""
    if mx == 0.0 and my == 0.0 and mz == 0.0:
        return
    q, rest = s.tilt, s.rest
    x, y, z = turned(
        q[e, n, Q_6D], q[e, n, Q_6D + 1], q[e, n, Q_6D + 2], q[e, n, Q_6D + 3], mx, my, mz
    )
    gx, gy, gz = rest[e, n, GYR], rest[e, n, GYR + 1], rest[e, n, GYR + 2]
    rate = math.sqrt(gx * gx + gy * gy + gz * gz)
    correct_heading(s.magnetic, c, e, n, x, y, z, rate)


@small_kernel
def about_vertical(cos, sin, q, e, n):
    """Return the 6D orientation rotated about the vertical, by cos and sin of the half angle."""
    w, x, y, z = q[e, n, Q_6D], q[e, n, Q_6D + 1], q[e, n, Q_6D + 2], q[e, n, Q_6D + 3]
    return cos * w - sin * z, cos * x - sin * y, cos * y + sin * x, cos * z + sin * w


@kernel
def run_vqf(c, s, samples, field, has_field, q_6d, q_9d, bias, resting):
    """Run VQF alone over a recording of every node, without the additions of `orient`.

    Args:
        c: OrientationCoefficients.
        s: OrientationState, updated.
        samples: Gyroscope [rad/s] and specific force [m/s2], (env, node, sample, 6).
        field: Magnetic field, any unit, (env, node, sample, 3).
        has_field: True for samples with a field, (env, node, sample).
        q_6d: Orientations without magnetometer, (env, node, sample, 4), written.
        q_9d: Orientations with magnetometer, (env, node, sample, 4), written.
        bias: Gyroscope biases, (env, node, sample, 3) [rad/s], written.
        resting: True at rest, (env, node, sample), written.
    """
    for e in range(samples.shape[0]):
        for n in range(samples.shape[1]):
            for k in range(samples.shape[2]):
                gx, gy, gz = samples[e, n, k, 0], samples[e, n, k, 1], samples[e, n, k, 2]
                ax, ay, az = samples[e, n, k, 3], samples[e, n, k, 4], samples[e, n, k, 5]
                update_vqf(s, c, e, n, c.dt[n], gx, gy, gz, ax, ay, az)
                if has_field[e, n, k]:
                    mx, my, mz = field[e, n, k, 0], field[e, n, k, 1], field[e, n, k, 2]
                    update_heading(s, c, e, n, mx, my, mz)
                turn = about_vertical(s.magnetic[e, n, COS], s.magnetic[e, n, SIN], s.tilt, e, n)
                for a in range(4):
                    q_6d[e, n, k, a] = s.tilt[e, n, Q_6D + a]
                    q_9d[e, n, k, a] = turn[a]
                for a in range(3):
                    bias[e, n, k, a] = s.bias[e, n, BIAS + a]
                resting[e, n, k] = s.rest[e, n, RESTING] != 0.0
