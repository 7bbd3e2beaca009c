"""Inertial samples that cannot be: a sensor that sticks, or jumps.

Such samples are dropped before the orientation filter sees them. A gyroscope that repeats one
reading turns the node for ever, and a single absurd one by half a radian; either takes tens of
seconds of magnetometer to undo.
"""

from __future__ import annotations

from tracking.kernels.jit import small_kernel

SEEN, N_SAME, N_ODD, LAST, GOOD = 0, 1, 2, 3, 9
N_HEALTH = 15
"""Columns of the memory: any sample yet; equal readings in a row before the last; odd readings in
a row; the last reading; the last that was believed."""


@small_kernel
def noise_scale(health, e, n, cut_x, cut_y, cut_z, levelled):
    """How much of `OrientationParams.doubtful_psd` an acceleration is worse by [-].

    Args:
        health: Memory, (env, node, N_HEALTH).
        e: Environment.
        n: Node.
        cut_x: True where the scale of the accelerometer cut its x off.
        cut_y: The same of y.
        cut_z: The same of z, which a vehicle that stays level does not need.
        levelled: True for such a vehicle.
    """
    is_cut = cut_x or cut_y or (cut_z and not levelled)
    return 1.0 if is_cut or health[e, n, N_ODD] > 0.0 else 0.0


@small_kernel
def inspect_sample(q, health, e, n, values, row, k):
    """Judge a sample; what is to be used instead of it is in the columns GOOD.

    Args:
        q: Record of `SanityParams`.
        health: Memory, (env, node, N_HEALTH), updated; zeros before the first sample.
        e: Environment.
        n: Node.
        values: From column 0, gyroscope [rad/s] and specific force [m/s2], (row, sample, 6...).
        row: Of `values`.
        k: Sample.

    Returns:
        True unless the sensor sticks.
    """
    seen = health[e, n, SEEN] != 0.0
    equal, odd = seen, False
    for a in range(6):
        x = values[row, k, a]
        equal = equal and x == health[e, n, LAST + a]
        health[e, n, LAST + a] = x
        odd = odd or abs(x - health[e, n, GOOD + a]) > (q.gyr_jump if a < 3 else q.acc_jump)
    health[e, n, SEEN] = 1.0
    health[e, n, N_SAME] = health[e, n, N_SAME] + 1.0 if equal else 0.0
    health[e, n, N_ODD] = health[e, n, N_ODD] + 1.0 if odd and seen else 0.0
    if health[e, n, N_ODD] == 0.0 or health[e, n, N_ODD] > q.odd_most:
        health[e, n, N_ODD] = 0.0
        for a in range(6):
            health[e, n, GOOD + a] = health[e, n, LAST + a]
    return health[e, n, N_SAME] < q.stuck_after
