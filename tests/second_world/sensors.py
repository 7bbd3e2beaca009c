"""Sensors of the second world."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

G = 9.81


def read_imu(world, vehicle, motion, t, rng):
    """Return angular rate, specific force and magnetic field in the IMU's axes, (time, 9)."""
    imu, field = world.imu, world.field
    mount = Rotation.from_euler("ZYX", vehicle.tilt[::-1])
    sensor = motion.turns(t) * mount
    speed = np.linalg.norm(motion.place(t, 1), axis=1) / vehicle.top_speed
    force = in_space(motion.place(t, 2)) + [0.0, 0.0, G]
    rate = motion.rates(t)
    iron = rng.normal(0.0, field.iron, 3)
    earth = np.array([0.0, field.level, -field.down]) + steel(world, motion.place(t))
    n = (len(t), 3)
    gyr = mount.inv().apply(rate) + rng.normal(0.0, imu.gyr_bias, 3)
    gyr += rng.normal(0.0, imu.gyr_noise, n)
    acc = sensor.inv().apply(force) + rng.normal(0.0, imu.acc_bias, 3)
    acc += rng.normal(0.0, imu.acc_noise, n)
    acc += rng.normal(0.0, 1.0, n) * (imu.vibration * np.minimum(speed, 1.0))[:, None]
    mag = sensor.inv().apply(earth) + iron + rng.normal(0.0, field.noise, n)
    return np.column_stack([gyr, acc, mag])


def in_space(vectors):
    """Return vectors padded with zeros to three axes, (time, 3)."""
    return np.column_stack([vectors, np.zeros((len(vectors), 3 - vectors.shape[1]))])


def steel(world, place):
    """Return the magnetic disturbance of the building, common to all cars, (time, 3) [uT]."""
    rng = np.random.default_rng([world.seed, 1])
    total = np.zeros((len(place), 3))
    for _ in range(6):
        heading, phase = rng.uniform(0.0, 2.0 * np.pi, 2)
        along = place[:, :2] @ np.array([np.cos(heading), np.sin(heading)])
        wave = np.sin(2.0 * np.pi * along / world.field.length + phase)
        total += wave[:, None] * rng.normal(0.0, world.field.bend / np.sqrt(3.0), 3)
    return total


def read_ranges(world, motions, rng):
    """Return ranges of all pairs in order of time: time [s], i, j, range [m], 1 if NLOS."""
    radio, n = world.radio, len(world.vehicles)
    pairs = [(i, j) for i in range(n) for j in range(i + 1, n)]
    rows = []
    for k, (i, j) in enumerate(pairs):
        t = (np.arange(int(world.seconds * radio.hz)) + (k + 0.5) / len(pairs)) / radio.hz
        t = t[rng.random(len(t)) >= radio.loss]
        true = np.linalg.norm(motions[i].place(t) - motions[j].place(t), axis=1)
        step = np.diff(t, prepend=t[0])
        slow, excess = np.zeros(len(t)), np.zeros(len(t))
        is_long = rng.random() < radio.long_share
        size = rng.uniform(*radio.long_excess)
        for m, dt in enumerate(step):
            keep = np.exp(-dt / radio.slow_time) if m else 0.0
            last = slow[m - 1] if m else 0.0
            slow[m] = keep * last + np.sqrt(1.0 - keep**2) * radio.slow * rng.normal()
            leave = dt / radio.long_time
            enter = leave * radio.long_share / max(1.0 - radio.long_share, 1e-9)
            if rng.random() < (leave if is_long else enter):
                is_long, size = not is_long, rng.uniform(*radio.long_excess)
            excess[m] = size if is_long else 0.0
        metres = true + slow + excess + rng.normal(0.0, radio.white, len(t))
        rows.append(
            np.column_stack([t, np.full((len(t), 2), (i, j)), np.maximum(metres, 0.01), excess > 0])
        )
    rows = np.concatenate(rows)
    return rows[np.argsort(rows[:, 0], kind="stable")]
