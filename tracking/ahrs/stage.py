"""Conversion of inertial samples to states, in one pass over the events of every environment.

A field is kept until the next inertial sample of its node. A sample is checked, then processed by
VQF after interpolated samples in place of lost ones; its event becomes a STATE in place.
"""

from __future__ import annotations

import math

from tracking.ahrs.gyro_bias import BIAS, RESTING, mean_variance, worst_variance
from tracking.ahrs.magnetometer import COS, GAIN, SIN
from tracking.ahrs.vqf import (
    N_ACC_READ,
    Q_6D,
    TURN,
    about_vertical,
    start_vqf,
    turned,
    update_heading,
    update_vqf,
)
from tracking.kernels.jit import kernel, small_kernel
from tracking.measurements import ACCEL_NOISE, AHRS_STATUS, GYRO_BIAS, GYRO_VAR, UPRIGHT
from tracking.sanity.imu import GOOD, find_limits, inspect_sample, noise_scale

# Plain numbers of `Kind`: kernels do not know enums.
MAG, IMU, STATE = 1, 2, 3

STARTED, T, GRAVITY, COS_YAW, SIN_YAW = 0, 1, 2, 3, 4
LAST_GYR, LAST_ACC, FIELD, HAS_FIELD, SEEN_FIELD, TURNED = 5, 8, 11, 14, 15, 16
MOVED, BEHIND = 18, 19
N_NODE = 20
"""Columns of a node's state in addition to its VQF: 1 after the first sample; its time [s]; norm
of gravity [m/s2]; cosine and sine of half the yaw that gives the initial heading; the last sample,
gyroscope [rad/s] and specific force [m/s2]; a field without a later sample, and 1 if there is one;
1 after a field was used; accumulated tilt correction about x and y of the world [rad]; 1 if it
moved while its orientation settled; lag of the gyroscope's integration time behind the last stamp
[s]."""


@kernel
def orient(c, s, t, kind, node, values, valid):
    """Convert IMU events into STATE events and MAG events into padding, in place.

    For a slice of environments, `s` holds the same slice.

    Args:
        c: OrientationCoefficients.
        s: OrientationState, updated.
        t: Time, (env, event) [s], in order.
        kind: `Kind` of the events, (env, event), written.
        node: Node of the events, (env, event).
        values: Measured values, (env, event, N_VALUES), written.
        valid: False for padding, (env, event), written.
    """
    for e in range(t.shape[0]):
        for k in range(t.shape[1]):
            if not valid[e, k]:
                continue
            what, n = kind[e, k], node[e, k]
            if what == IMU:
                take_sample(c, s, e, n, t[e, k], kind, values, valid, k)
            elif what == MAG:
                for a in range(3):
                    s.node[e, n, FIELD + a] = values[e, k, a]
                s.node[e, n, HAS_FIELD] = 1.0
                valid[e, k] = False


@small_kernel
def take_sample(c, s, e, n, t, kind, values, valid, k):
    """Process the inertial sample of node n in column k."""
    m, good = s.node, s.health
    has_field = m[e, n, HAS_FIELD] != 0.0 and c.magnetic[n]
    m[e, n, HAS_FIELD] = 0.0
    if not inspect_sample(c.sanity[0], s.health, e, n, values, e, k, c.dt[n]):
        valid[e, k] = False
        return
    ax, ay, az = good[e, n, GOOD + 3], good[e, n, GOOD + 4], good[e, n, GOOD + 5]
    cut_x, cut_y, cut_z, upright = find_limits(c.sanity[0], s.limits, e, n, ax, ay, az)
    n_lost, dt = find_gap(c, s, e, n, t)
    integrate_over(c, s, e, n, n_lost, dt, upright)
    is_settling = settles(c, s, e, n, ax, ay, az)
    if has_field:
        if is_settling:
            s.magnetic[e, n, GAIN] = 1.0
        update_heading(s, c, e, n, m[e, n, FIELD], m[e, n, FIELD + 1], m[e, n, FIELD + 2])
        m[e, n, SEEN_FIELD] = 1.0
    if m[e, n, STARTED] == 0.0:
        start_heading(c, s, e, n)
        m[e, n, STARTED] = 1.0
    m[e, n, T] = t
    if upright and s.rest[e, n, RESTING] != 0.0:
        length = math.sqrt(ax * ax + ay * ay + az * az)
        m[e, n, GRAVITY] += c.gravity_gain[n] * (length - m[e, n, GRAVITY])

    cos, sin = m[e, n, COS_YAW], m[e, n, SIN_YAW]
    if c.magnetic[n]:
        cos, sin = s.magnetic[e, n, COS], s.magnetic[e, n, SIN]
    qw, qx, qy, qz = about_vertical(cos, sin, s.tilt, e, n)
    x, y, z = turned(qw, qx, qy, qz, ax, ay, az)
    kind[e, k] = STATE
    values[e, k, 0], values[e, k, 1], values[e, k, 2], values[e, k, 3] = qw, qx, qy, qz
    values[e, k, 4], values[e, k, 5], values[e, k, 6] = x, y, z - m[e, n, GRAVITY]
    scale = noise_scale(s.health, e, n, cut_x, cut_y, cut_z, c.levelled[n])
    values[e, k, ACCEL_NOISE] = scale * c.doubtful_psd[n]
    tell_upright(s, e, n, cos, sin, values, k)
    valid[e, k] = (m[e, n, SEEN_FIELD] != 0.0 or not c.magnetic[n]) and not is_settling


@small_kernel
def settles(c, s, e, n, ax, ay, az):
    """Return whether node n moves while its orientation is new (`OrientationParams.settling`)."""
    if s.tilt[e, n, N_ACC_READ] > c.settling_samples[n]:
        return False
    length = math.sqrt(ax * ax + ay * ay + az * az)
    if abs(length - s.node[e, n, GRAVITY]) > c.settling_accel[n]:
        s.node[e, n, MOVED] = 1.0
    return s.node[e, n, MOVED] != 0.0


@small_kernel
def tell_upright(s, e, n, cos, sin, values, k):
    """Write the accumulated tilt correction and the gyroscope bias of node n.

    Cosine and sine are of half the yaw that gives its heading.
    """
    m, q = s.node, s.tilt
    turn_cos, turn_sin = cos * cos - sin * sin, 2.0 * cos * sin
    x, y = q[e, n, TURN], q[e, n, TURN + 1]
    q[e, n, TURN] = q[e, n, TURN + 1] = 0.0
    m[e, n, TURNED] += turn_cos * x - turn_sin * y
    m[e, n, TURNED + 1] += turn_sin * x + turn_cos * y
    values[e, k, AHRS_STATUS] = 2.0 if s.rest[e, n, RESTING] != 0.0 else 1.0
    values[e, k, UPRIGHT], values[e, k, UPRIGHT + 1] = m[e, n, TURNED], m[e, n, TURNED + 1]
    for a in range(3):
        values[e, k, GYRO_BIAS + a] = s.bias[e, n, BIAS + a]
    values[e, k, GYRO_VAR] = mean_variance(s.bias, e, n)


@small_kernel
def find_gap(c, s, e, n, t):
    """Return the number of samples lost before time t [s], and the sample interval [s].

    Sampling is assumed steady: the integration time of the gyroscope follows the stamps slowly,
    which smooths jitter and preserves the total time. VQF restarts after a long gap.
    """
    m, dt, n_lost = s.node, c.dt[n], 0
    gap = t - m[e, n, T]
    behind = gap + m[e, n, BEHIND]
    if m[e, n, STARTED] == 0.0 or gap > c.max_gap[n]:
        if m[e, n, STARTED] != 0.0 and c.magnetic[n]:
            # The orientation is unknown; the gyroscope bias estimated at rest remains valid.
            start_vqf(s, c, e, n, worst_variance(s.bias, c, e, n))
            m[e, n, SEEN_FIELD] = m[e, n, MOVED] = 0.0
        m[e, n, BEHIND] = 0.0
        return 0, dt
    if min(gap, behind) * c.rate[n] > c.lost_after[n]:
        n_lost = round(behind * c.rate[n]) - 1
    dt += c.stamp_gain[n] * (behind / (n_lost + 1) - dt)
    m[e, n, BEHIND] = behind - (n_lost + 1) * dt
    return n_lost, dt


@small_kernel
def integrate_over(c, s, e, n, n_lost, dt, upright):
    """Run VQF on the accepted sample, after interpolated samples in place of lost ones."""
    m, good = s.node, s.health
    for step in range(n_lost, -1, -1):
        w = step / (n_lost + 1.0)
        gx, gy, gz = good[e, n, GOOD], good[e, n, GOOD + 1], good[e, n, GOOD + 2]
        ax, ay, az = good[e, n, GOOD + 3], good[e, n, GOOD + 4], good[e, n, GOOD + 5]
        if step > 0:
            gx += w * (m[e, n, LAST_GYR] - gx)
            gy += w * (m[e, n, LAST_GYR + 1] - gy)
            gz += w * (m[e, n, LAST_GYR + 2] - gz)
            ax += w * (m[e, n, LAST_ACC] - ax)
            ay += w * (m[e, n, LAST_ACC + 1] - ay)
            az += w * (m[e, n, LAST_ACC + 2] - az)
        elif not upright:
            ax = ay = az = 0.0  # no tilt correction
        update_vqf(s, c, e, n, dt, gx, gy, gz, ax, ay, az)
    for a in range(3):
        m[e, n, LAST_GYR + a] = good[e, n, GOOD + a]
        m[e, n, LAST_ACC + a] = good[e, n, GOOD + 3 + a]


@small_kernel
def start_heading(c, s, e, n):
    """Compute the yaw that gives the first orientation the initial heading."""
    q = s.tilt
    w, x, y, z = q[e, n, Q_6D], q[e, n, Q_6D + 1], q[e, n, Q_6D + 2], q[e, n, Q_6D + 3]
    half = 0.5 * (c.heading[n] - math.atan2(2 * (x * y + w * z), 1 - 2 * (y * y + z * z)))
    s.node[e, n, COS_YAW], s.node[e, n, SIN_YAW] = math.cos(half), math.sin(half)


@kernel
def forget(c, s, gravity):
    """Reset every environment and node of `s` to the state before any measurement.

    Args:
        c: OrientationCoefficients.
        s: OrientationState, written.
        gravity: Assumed norm of gravity [m/s2].
    """
    for e in range(s.node.shape[0]):
        for n in range(s.node.shape[1]):
            for memory in (s.node, s.health, s.limits, s.bias):
                for k in range(memory.shape[2]):
                    memory[e, n, k] = 0.0
            start_vqf(s, c, e, n, c.start_var[n])
            s.node[e, n, GRAVITY], s.node[e, n, COS_YAW] = gravity, 1.0
