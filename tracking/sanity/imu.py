"""Detection of stuck and spiking inertial sensors.

Such samples are kept from the orientation filter: a gyroscope that repeats one reading turns
the node without end, and a single absurd reading by half a radian; the magnetometer takes tens
of seconds to correct either.
"""

from __future__ import annotations

from tracking.kernels.jit import small_kernel

SEEN, N_SAME, N_ODD, LAST, GOOD = 0, 1, 2, 3, 9
N_HEALTH = 15
"""Columns of the memory: 1 after the first sample; equal readings in a row before the last; odd
readings in a row; the last reading; the last accepted reading."""


@small_kernel
def noise_scale(health, e, n, cut_x, cut_y, cut_z, levelled):
    """Return the factor on `OrientationParams.doubtful_psd` of an acceleration [-].

    Args:
        health: Memory, (env, node, N_HEALTH).
        e: Environment.
        n: Node.
        cut_x: True if x of the accelerometer is saturated.
        cut_y: True if y of the accelerometer is saturated.
        cut_z: True if z is saturated, which vehicles that stay level do not use.
        levelled: True for vehicles that stay level.
    """
    is_cut = cut_x or cut_y or (cut_z and not levelled)
    return 1.0 if is_cut or health[e, n, N_ODD] > 0.0 else 0.0


@small_kernel
def inspect_sample(q, health, e, n, values, row, k, dt):
    """Check a sample; the columns GOOD hold the reading to use in its place.

    Args:
        q: Record of `SanityParams`.
        health: Memory, (env, node, N_HEALTH), updated; zeros before the first sample.
        e: Environment.
        n: Node.
        values: Gyroscope [rad/s] and specific force [m/s2] from column 0, (row, sample, 6...).
        row: Row of `values`.
        k: Sample of `values`.
        dt: Sample period of the node [s].

    Returns:
        False for a sensor that is stuck.
    """
    seen = health[e, n, SEEN] != 0.0
    equal, odd = seen, False
    gyr_jump = q.gyr_jump * max(1.0, dt / q.jump_period)
    for a in range(6):
        x = values[row, k, a]
        equal = equal and x == health[e, n, LAST + a]
        health[e, n, LAST + a] = x
        odd = odd or abs(x - health[e, n, GOOD + a]) > (gyr_jump if a < 3 else q.acc_jump)
    health[e, n, SEEN] = 1.0
    health[e, n, N_SAME] = health[e, n, N_SAME] + 1.0 if equal else 0.0
    health[e, n, N_ODD] = health[e, n, N_ODD] + 1.0 if odd and seen else 0.0
    if health[e, n, N_ODD] == 0.0 or health[e, n, N_ODD] > q.odd_most:
        health[e, n, N_ODD] = 0.0
        for a in range(6):
            health[e, n, GOOD + a] = health[e, n, LAST + a]
    return health[e, n, N_SAME] < q.stuck_after
