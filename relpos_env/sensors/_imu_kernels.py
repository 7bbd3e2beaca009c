"""IMU of a car, one sample at a time, with the formulas of `relpos_env.sensors.imu`."""

from __future__ import annotations

import math

import numpy as np

from relpos_env.sensors.radio._normal_kernels import normal
from relpos_env.sensors.radio._random_kernels import draw_key
from tracking.kernels.jit import kernel, small_kernel

GRAVITY = 9.81
DRIFT_EVERY = 10
"""[-] Samples between two updates of the bias drift; its time constant is 1000 times as long."""
STARTS = 1 << 50
"""First counter of the draws at the start of an episode."""


@kernel
def start_imus(p, seed, bias, drift, e):
    """Draw the residual biases of every IMU of an environment after calibration.

    Args:
        p: IMU of the environment.
        seed: Seed of its IMUs, uint64.
        bias: Constant part, (env, node, 6) [rad/s, m/s2], written.
        drift: Slow part, (env, node, 6) [rad/s, m/s2], written.
        e: Index of the environment.
    """
    for n in range(bias.shape[1]):
        key = draw_key(seed, np.uint64(STARTS + n))
        for half in range(2):
            constant = p.gyr_bias if half == 0 else p.acc_bias
            slow = p.gyr_drift if half == 0 else p.acc_drift
            for a in range(3):
                bias[e, n, 3 * half + a] = constant * normal(key, 3 * half + a)
                drift[e, n, 3 * half + a] = slow * normal(key, 6 + 3 * half + a)


@small_kernel
def read_imu(p, seed, count, bias, drift, e, n, truth, speed, out, row):
    """Write one sample of one IMU.

    Args:
        p: IMU of the environment.
        seed: Seed of its IMUs, uint64.
        count: Number of the sample.
        bias: Constant bias, (env, node, 6) [rad/s, m/s2].
        drift: Slow bias, (env, node, 6) [rad/s, m/s2], updated.
        e: Index of the environment.
        n: Index of the node.
        truth: Six numbers: angular rate [rad/s] and specific force [m/s2] in the body frame.
        speed: Speed of the carrier [m/s].
        out: Values of events, (env, event, ...); columns 0 to 5 of the row are written.
        row: Index of the event.
    """
    key = draw_key(seed, np.uint64(count * 64 + n))
    if count % DRIFT_EVERY == 0:
        for k in range(3):
            gyr_noise, acc_noise = normal(key, 6 + k), normal(key, 9 + k)
            drift[e, n, k] = p.keep * drift[e, n, k] + p.gyr_step * gyr_noise
            drift[e, n, 3 + k] = p.keep * drift[e, n, 3 + k] + p.acc_step * acc_noise
    share = min(abs(speed) / p.vibration_speed, 1.0)
    gyr_var = p.gyr_noise**2 + (share * p.gyr_vibration) ** 2
    acc_var = p.acc_noise**2 + (share * p.vibration) ** 2
    gyr_std, acc_std = math.sqrt(gyr_var), math.sqrt(acc_var)
    gyr_steps, acc_steps = steps_per_unit(p.gyr_resolution), steps_per_unit(p.acc_resolution)
    for k in range(3):
        gyr = truth[k] + bias[e, n, k] + drift[e, n, k] + gyr_std * normal(key, k)
        acc = truth[3 + k] + bias[e, n, 3 + k] + drift[e, n, 3 + k] + acc_std * normal(key, 3 + k)
        out[e, row, k] = quantise(gyr, p.gyr_range, p.gyr_resolution, gyr_steps)
        out[e, row, 3 + k] = quantise(acc, p.acc_range, p.acc_resolution, acc_steps)


@small_kernel
def steps_per_unit(resolution):
    """Return the steps of a converter per unit; 0 for a resolution of 0 (no rounding)."""
    return 1.0 / resolution if resolution > 0.0 else 0.0


@small_kernel
def quantise(reading, full_scale, resolution, steps):
    """Clip a reading to +- full scale and round it to the converter's resolution, if not 0."""
    cut = min(max(reading, -full_scale), full_scale)
    return math.floor(cut * steps + 0.5) * resolution if steps > 0.0 else cut


@small_kernel
def felt_on_car(yaw_rate, forward, left, roll, pitch, roll_rate, pitch_rate):
    """Return angular rate and specific force in the frame of a body that rolls and pitches.

    Args:
        yaw_rate: Yaw rate [rad/s].
        forward: Horizontal acceleration along the heading [m/s2].
        left: Horizontal acceleration to the left of it [m/s2].
        roll: Cosine and sine of the angle about the forward axis, left side up is positive.
        pitch: Cosine and sine of the angle about the left axis, nose down is positive.
        roll_rate: Roll rate [rad/s].
        pitch_rate: Pitch rate [rad/s].
    """
    cr, sr = roll
    cp, sp = pitch
    x = cp * forward - sp * GRAVITY
    z = sp * forward + cp * GRAVITY
    return (
        roll_rate - sp * yaw_rate,
        cr * pitch_rate + sr * cp * yaw_rate,
        -sr * pitch_rate + cr * cp * yaw_rate,
        x,
        cr * left + sr * z,
        -sr * left + cr * z,
    )
