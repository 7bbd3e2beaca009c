"""Magnetometer of a car, with the formulas of `relpos_env.sensors.magnetometer`."""

from __future__ import annotations

import math

import numpy as np

from relpos_env.sensors._imu_kernels import STARTS, quantise, steps_per_unit
from relpos_env.sensors.radio._normal_kernels import normal
from relpos_env.sensors.radio._random_kernels import draw_key, uniform
from tracking.kernels.jit import kernel, small_kernel

N_WAVE = 6
"""Columns of a wave: wave vector x, y [turns/m], phase [turns], amplitude x, y, z [uT]."""
SINE = tuple((-1) ** k / math.factorial(2 * k + 1) for k in range(1, 7))
"""Taylor coefficients of sin(x) for x^3, x^5, ...; exact to 1e-9 up to a quarter turn."""


@kernel
def start_magnetometers(p, seed, waves, hard_iron, e):
    """Draw the field of a building and the residual hard iron of every magnetometer.

    Args:
        p: MAG of the environment.
        seed: Seed of its magnetometers, uint64.
        waves: Waves of the field, (env, wave, N_WAVE), written.
        hard_iron: Offsets, (env, node, 3) [uT], written.
        e: Index of the environment.
    """
    n_waves = int(p.n_waves)
    scale = p.disturbance * math.sqrt(2.0 / max(n_waves, 1))
    for k in range(waves.shape[1]):
        key = draw_key(seed, np.uint64(STARTS + 64 + k))
        angle = 2.0 * math.pi * uniform(key, 0)
        length = p.wavelength * (0.6 + uniform(key, 1))
        waves[e, k, 0] = math.cos(angle) / length
        waves[e, k, 1] = math.sin(angle) / length
        waves[e, k, 2] = uniform(key, 2)
        here = scale if k < n_waves else 0.0
        for a in range(3):
            waves[e, k, 3 + a] = here * normal(key, 1 + a)
    for n in range(hard_iron.shape[1]):
        key = draw_key(seed, np.uint64(STARTS + n))
        for a in range(3):
            hard_iron[e, n, a] = p.hard_iron * normal(key, a)


@small_kernel
def cosine_of_turns(x):
    """Return cos(2 pi x) = 1 - 2 sin(pi x)^2, inlined: it dominates the cost of a reading."""
    half = math.pi * (x - np.rint(x))
    square = half * half
    rest = 0.0
    for coefficient in SINE[::-1]:
        rest = square * (coefficient + rest)
    sine = half + half * rest
    return 1.0 - 2.0 * sine * sine


@small_kernel
def read_magnetometer(p, seed, count, waves, hard_iron, e, n, at, heading, roll, pitch, out, row):
    """Write one reading of one magnetometer.

    Args:
        p: MAG of the environment.
        seed: Seed of its magnetometers, uint64.
        count: Number of the sample.
        waves: Waves of the field, (env, wave, N_WAVE).
        hard_iron: Offsets, (env, node, 3) [uT].
        e: Index of the environment.
        n: Index of the node.
        at: x, y of the node [m].
        heading: Cosine and sine of the heading.
        roll: Cosine and sine of the roll.
        pitch: Cosine and sine of the pitch.
        out: Values of events, (env, event, ...); columns 0 to 2 of the row are written.
        row: Index of the event.
    """
    x, y, z = p.field_x, p.field_y, p.field_z
    for k in range(waves.shape[1]):
        wave = cosine_of_turns(waves[e, k, 0] * at[0] + waves[e, k, 1] * at[1] + waves[e, k, 2])
        x += wave * waves[e, k, 3]
        y += wave * waves[e, k, 4]
        z += wave * waves[e, k, 5]
    c, s = heading
    x, y = c * x + s * y, c * y - s * x
    cr, sr = roll
    cp, sp = pitch
    x, z = cp * x - sp * z, sp * x + cp * z
    y, z = cr * y + sr * z, cr * z - sr * y
    key = draw_key(seed, np.uint64(count * 64 + n))
    steps = steps_per_unit(p.resolution)
    for a, field in enumerate((x, y, z)):
        reading = field + hard_iron[e, n, a] + p.noise * normal(key, a)
        out[e, row, a] = quantise(reading, p.full_scale, p.resolution, steps)
