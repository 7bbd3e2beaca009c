"""Inertial samples that cannot be: a sensor that sticks, or jumps.

Such samples are dropped before the orientation filter sees them. A gyroscope that repeats one
reading turns the node for ever, and a single absurd one by half a radian; either takes tens of
seconds of magnetometer to undo.
"""

from __future__ import annotations

from tracking.jit import kernel, small_kernel

STUCK_AFTER = 20
"""[-] Readings in a row that are equal in all six axes; noise makes two of them rare."""
GYR_JUMP = 25.0
"""[rad/s] A change between two samples that no carrier makes."""
ACC_JUMP = 400.0
"""[m/s2] The same of the specific force."""
MAX_ODD = 3
"""[-] So many odd readings in a row are believed after all."""

SEEN, N_SAME, N_ODD, LAST, GOOD = 0, 1, 2, 3, 9
N_HEALTH = 15
"""Columns of the memory: any sample yet; equal readings in a row before the last; odd readings in
a row; the last reading; the last that was believed."""


@small_kernel
def inspect_sample(health, e, n, values, row, k):
    """Judge a sample; what is to be used instead of it is in the columns GOOD.

    Args:
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
        odd = odd or abs(x - health[e, n, GOOD + a]) > (GYR_JUMP if a < 3 else ACC_JUMP)
    health[e, n, SEEN] = 1.0
    health[e, n, N_SAME] = health[e, n, N_SAME] + 1.0 if equal else 0.0
    health[e, n, N_ODD] = health[e, n, N_ODD] + 1.0 if odd and seen else 0.0
    if health[e, n, N_ODD] == 0.0 or health[e, n, N_ODD] > MAX_ODD:
        health[e, n, N_ODD] = 0.0
        for a in range(6):
            health[e, n, GOOD + a] = health[e, n, LAST + a]
    return health[e, n, N_SAME] < STUCK_AFTER


@kernel
def inspect(health, samples, usable):
    """Replace odd samples by the one before, and note where a sensor is not stuck.

    Args:
        health: Memory, (env, node, N_HEALTH), updated; zeros before the first sample.
        samples: Gyroscope [rad/s] and specific force [m/s2], (env, sample, 6), in order,
            all of node 0; replaced.
        usable: Written, True where they mean anything, (env, sample).
    """
    for e in range(samples.shape[0]):
        for k in range(samples.shape[1]):
            usable[e, k] = inspect_sample(health, e, 0, samples, e, k)
            for a in range(6):
                samples[e, k, a] = health[e, 0, GOOD + a]
