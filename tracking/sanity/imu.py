"""Detection of stuck, spiking and saturated inertial sensors.

**Stuck, spiking.** Such samples are kept from the orientation filter: a gyroscope that repeats one
reading turns the node without end, and a single absurd reading by half a radian; the magnetometer
takes tens of seconds to correct either.

**Saturated** is an axis of the accelerometer with flat tops in a lively signal. It repeats one
number, the largest or the smallest of its readings. A run of equal readings counts as saturation if
it is longer than by chance, which depends on the sensor's rounding and is estimated from the
readings, and if it lies away from their mean. The limit is known from then on: single readings at
it count as well, until one exceeds it. An axis that repeats itself for long while another changes
counts, too: it may have been beyond its limit from the start. Readings that are equal in all axes
do not count: they replace lost ones. Saturated readings are used with more noise, but neither they
nor the readings around them correct the tilt: without the largest readings, the mean acceleration
of a motion is not zero.
"""

from __future__ import annotations

import math

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


PREVIOUS, RUN, MEAN, SHARE, LOW, HIGH, START = 0, 1, 2, 3, 4, 5, 6
N_AXIS = 7
STARTED, N_WHOLE = 3 * N_AXIS, 3 * N_AXIS + 1
N_LIMIT = 3 * N_AXIS + 2
"""Columns of the memory. For each axis: last reading; number of equal ones before it; mean; share
of equal ones; limits found, infinite for none; sum of the other two axes at the start of the run.
Then: 1 after the first reading; number of unsaturated readings in a row."""


@small_kernel
def start_limits(q, memory, e, n, x, y, z):
    """Initialise the memory with a reading."""
    for a in range(3):
        at = a * N_AXIS
        first = (x, y, z)[a]
        memory[e, n, at + PREVIOUS] = first + 1.0  # equal to none
        memory[e, n, at + MEAN], memory[e, n, at + SHARE] = first, q.equal_least
        memory[e, n, at + LOW], memory[e, n, at + HIGH] = -math.inf, math.inf
    memory[e, n, STARTED], memory[e, n, N_WHOLE] = 1.0, q.whole_after


@small_kernel
def is_at_limit(q, memory, e, n, at, x, others, held):
    """Return whether the reading of one axis is at its limit.

    Args:
        q: Record of `SanityParams`.
        memory: Updated, (env, node, N_LIMIT).
        e: Environment.
        n: Node.
        at: First column of the axis.
        x: Reading of the axis [m/s2].
        others: Sum of the readings of the other axes [m/s2].
        held: True if all three axes repeat their last reading.
    """
    equal = x == memory[e, n, at + PREVIOUS]
    run = memory[e, n, at + RUN]
    if not equal:
        run = 0.0
        memory[e, n, at + START] = others
    elif not held:
        run += 1.0
    memory[e, n, at + PREVIOUS], memory[e, n, at + RUN] = x, run
    mean = memory[e, n, at + MEAN]
    if x > memory[e, n, at + HIGH] or x < memory[e, n, at + LOW]:
        memory[e, n, at + LOW], memory[e, n, at + HIGH] = -math.inf, math.inf
    if run > 0.0:
        rare = min(max(memory[e, n, at + SHARE], q.equal_least), q.equal_most)
        if abs(x - mean) > q.limit_least and run * math.log(rare) < q.chance:
            if x > mean:
                memory[e, n, at + HIGH] = x
            else:
                memory[e, n, at + LOW] = x
        if run >= q.held_long and abs(others - memory[e, n, at + START]) > q.held_change:
            memory[e, n, at + LOW], memory[e, n, at + HIGH] = x, x
    if x == memory[e, n, at + LOW] or x == memory[e, n, at + HIGH]:
        return True
    share = memory[e, n, at + SHARE]
    memory[e, n, at + SHARE] = share + ((1.0 if equal else 0.0) - share) / q.equal_memory
    memory[e, n, at + MEAN] = mean + (x - mean) / q.mean_memory
    return False


@small_kernel
def find_limits(q, memory, e, n, x, y, z):
    """Return which axes are saturated, and update their limits.

    Args:
        q: Record of `SanityParams`.
        memory: Updated, (env, node, N_LIMIT); zeros before the first sample.
        e: Environment.
        n: Node.
        x: Specific force [m/s2].
        y: Specific force [m/s2], along y.
        z: Specific force [m/s2], along z.

    Returns:
        True for each saturated axis; True if the sample may correct the tilt.
    """
    if memory[e, n, STARTED] == 0.0:
        start_limits(q, memory, e, n, x, y, z)
    held = (
        x == memory[e, n, PREVIOUS]
        and y == memory[e, n, N_AXIS + PREVIOUS]
        and z == memory[e, n, 2 * N_AXIS + PREVIOUS]
    )
    cut_x = is_at_limit(q, memory, e, n, 0, x, y + z, held)
    cut_y = is_at_limit(q, memory, e, n, N_AXIS, y, z + x, held)
    cut_z = is_at_limit(q, memory, e, n, 2 * N_AXIS, z, x + y, held)
    whole = not (cut_x or cut_y or cut_z)
    memory[e, n, N_WHOLE] = memory[e, n, N_WHOLE] + 1.0 if whole else 0.0
    return cut_x, cut_y, cut_z, memory[e, n, N_WHOLE] >= q.whole_after
