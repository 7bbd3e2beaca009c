"""Preintegration of inertial samples per node until a measurement comes, and rest detection.

Between two STATE events the acceleration is the mean of both; until the second comes, the first is
held, and the difference is added then.
"""

from __future__ import annotations

import math

from tracking.filters.joint.ekf.columns import (
    BIAS_P,
    BIAS_V,
    DP,
    DT,
    DV,
    NOISE,
    ROTATION_P,
    ROTATION_V,
)
from tracking.filters.joint.ekf.imu_errors import process_tilt_correction
from tracking.filters.level_vehicle import angle_between, direction, level
from tracking.kernels.jit import small_kernel
from tracking.maths.elementary import decay
from tracking.measurements import ACCEL_NOISE


@small_kernel
def is_aided(c, node, t):
    """True if a node has recent samples of its IMU."""
    return node.has_state and t - node.t_state <= c.imu_timeout


@small_kernel
def preintegrate(c, nodes, held, pre, i, t):
    """Preintegrate node i until time t, with the acceleration it reported last."""
    node = nodes[i]
    dt = t - node.t_pre
    if dt <= 0.0:
        return
    node.t_pre = t
    half = 0.5 * dt * dt
    aided = is_aided(c, node, t)
    for k in range(3):
        a = held[i, 4 + k] if aided else 0.0
        pre[i, DP + k] += dt * pre[i, DV + k] + half * a
        pre[i, DV + k] += dt * a
    if not aided:
        pre[i, NOISE] += dt * c.unaided_psd2
    cos_b, sin_b = (1.0, 0.0) if aided else (0.0, 0.0)
    if node.levelled and aided:
        cos_b, sin_b = node.cos_yaw, node.sin_yaw
    pre[i, BIAS_P] += dt * pre[i, BIAS_V] + half * cos_b
    pre[i, BIAS_P + 1] += dt * pre[i, BIAS_V + 1] + half * sin_b
    pre[i, BIAS_V] += dt * cos_b
    pre[i, BIAS_V + 1] += dt * sin_b
    if node.i_acc_bias >= 0:
        preintegrate_rotation(held, pre, i, dt, 1.0 if aided else 0.0)
    pre[i, DT] += dt


@small_kernel
def preintegrate_rotation(held, pre, i, dt, share):
    """Preintegrate the orientation of node i, the derivatives by its accelerometer offset."""
    w, x, y, z = held[i, 0], held[i, 1], held[i, 2], held[i, 3]
    rotation = (
        1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y),
        2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x),
        2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y),
    )  # fmt: skip
    for k in range(9):
        once = share * dt * rotation[k]
        pre[i, ROTATION_P + k] += dt * pre[i, ROTATION_V + k] + 0.5 * dt * once
        pre[i, ROTATION_V + k] += once


@small_kernel
def process_attitude(c, nodes, held, pre, i, t, values, e, k):
    """Process a new orientation and acceleration of node i, held until the next."""
    node = nodes[i]
    noise = values[e, k, ACCEL_NOISE]
    if node.has_state and (noise > 0.0 or node.accel_noise > 0.0):
        dt = min(max(t - node.t_state, 0.0), c.imu_timeout)
        pre[i, NOISE] += dt * max(noise, node.accel_noise) ** 2
    node.accel_noise = noise
    preintegrate(c, nodes, held, pre, i, t)
    w, x, y, z = values[e, k, 0], values[e, k, 1], values[e, k, 2], values[e, k, 3]
    cos_yaw, sin_yaw = direction(w, x, y, z)
    a0, a1, a2 = values[e, k, 4], values[e, k, 5], values[e, k, 6]
    dt = t - node.t_state
    fresh = not node.has_state or dt > c.imu_timeout
    is_new = not node.has_state or dt > c.attitude_reset_gap
    if is_new:
        node.t_oriented = t
    process_tilt_correction(node, pre, i, values, e, k, is_new)
    if not fresh and dt > 1e-4:
        # Angle between two orientations: twice the distance of their quaternions.
        qw, qx, qy, qz = held[i, 0], held[i, 1], held[i, 2], held[i, 3]
        cosine = abs(w * qw + x * qx + y * qy + z * qz)
        angle = 2.0 * math.sqrt(max(2.0 * (1.0 - min(cosine, 1.0)), 0.0))
        turn = angle_between(node.cos_yaw, node.sin_yaw, cos_yaw, sin_yaw)
        keep = decay(dt / c.yaw_rate_tau)
        node.yaw_rate = keep * node.yaw_rate + (1.0 - keep) * turn / dt
        keep = decay(dt / c.rest_tau)
        node.turning = keep * node.turning + (1.0 - keep) * angle / dt
    held[i, 0], held[i, 1], held[i, 2], held[i, 3] = w, x, y, z
    if node.levelled:
        a0, a1 = level(w, x, y, z, a0, a1, a2, cos_yaw, sin_yaw)
    if not fresh:
        # The first sample was held: its difference to the mean of both is added.
        half_v, half_p = 0.5 * dt, 0.25 * dt * dt
        pre[i, DV] += half_v * (a0 - held[i, 4])
        pre[i, DV + 1] += half_v * (a1 - held[i, 5])
        pre[i, DV + 2] += half_v * (a2 - held[i, 6])
        pre[i, DP] += half_p * (a0 - held[i, 4])
        pre[i, DP + 1] += half_p * (a1 - held[i, 5])
        pre[i, DP + 2] += half_p * (a2 - held[i, 6])
        squared = a0 * a0 + a1 * a1
        if squared > node.impact_threshold * node.impact_threshold:
            pre[i, NOISE] += (node.impact_noise_ratio * dt) ** 2 * squared
    held[i, 4], held[i, 5], held[i, 6] = a0, a1, a2
    node.cos_yaw, node.sin_yaw = cos_yaw, sin_yaw
    node.t_state = t
    node.has_state = True
    update_rest_detector(c, node, t, dt, math.sqrt(a0 * a0 + a1 * a1 + a2 * a2), fresh)


@small_kernel
def update_rest_detector(c, node, t, dt, accel, fresh):
    """Update the running means of the acceleration of a node, and the time of its last motion."""
    if fresh:
        node.accel_mean = accel
        node.accel_var = c.rest_accel * c.rest_accel
        node.turning = c.rest_rate
        node.yaw_rate = 0.0
        node.t_first = node.t_moved = node.t_accelerated = t
        return
    keep = decay(dt / c.rest_tau)
    off = accel - node.accel_mean
    node.accel_mean += (1.0 - keep) * off
    node.accel_var = keep * node.accel_var + (1.0 - keep) * off * off
    shaken = node.accel_var + c.rest_mean_share * node.accel_mean * node.accel_mean
    if shaken >= c.rest_accel * c.rest_accel:
        node.t_moved = node.t_accelerated = t
    elif node.turning >= c.rest_rate:
        node.t_moved = t
