"""Rest detection: the readings of a sensor stay near their own low pass, [1] sec. 3.4.

References:
    [1] Laidig, Seel, VQF, Information Fusion 91 (2023) 187.
"""

from __future__ import annotations

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
