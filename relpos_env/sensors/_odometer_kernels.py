"""Odometers of all cars, with the formulas of `relpos_env.sensors.odometer`."""

from __future__ import annotations

import math

import numpy as np

from relpos_env.sensors._imu_kernels import STARTS
from relpos_env.sensors.radio._normal_kernels import normal
from relpos_env.sensors.radio._random_kernels import draw_key
from tracking.kernels.jit import kernel


@kernel
def read_odometers(p, seeds, tick, body, present, out):
    """Write one reading of every car.

    Args:
        p: ODOMETER, (env).
        seeds: Seeds of the odometers, uint64, (env).
        tick: Number of the reading, (env).
        body: x, y, heading and velocities of cars, (env, car, 6).
        present: Mask of present cars, (env, car).
        out: Forward speed, (env, car) [m/s], written; 0 for absent cars.
    """
    for e in range(body.shape[0]):
        for n in range(body.shape[1]):
            out[e, n] = 0.0
            if present[e, n]:
                c, s = math.cos(body[e, n, 2]), math.sin(body[e, n, 2])
                # The relative error of the wheel radius is constant during an episode.
                scale = normal(draw_key(seeds[e], np.uint64(STARTS + n)), 0)
                noise = normal(draw_key(seeds[e], np.uint64(tick[e] * 64 + n)), 0)
                speed = c * body[e, n, 3] + s * body[e, n, 4]
                out[e, n] = (1.0 + p[e].scale_std * scale) * speed + p[e].noise * noise
