"""Axes of an accelerometer at the end of their scale: flat tops in a lively signal.

An axis that is cut off repeats one number, the largest or the smallest that it reads. A run of
equal readings is taken for that once it is longer than chance makes them, which depends on how
the sensor rounds and is learned from the readings themselves, and if it lies away from their
mean. The limit is then known: single readings of it count as well, until one goes beyond. An
axis that repeats itself for long while another changes is taken for the same: it may have been
beyond its limit from the beginning. Readings that are equal in all axes are none of this: they
stand for some that were lost.

What is cut off is used and doubted; but it tells no tilt, nor do the readings about it: the
largest left out, the mean acceleration of a motion is no longer zero.
"""

from __future__ import annotations

import math

from tracking.kernels.jit import small_kernel

LAST, RUN, MEAN, SHARE, LOW, HIGH, START = 0, 1, 2, 3, 4, 5, 6
N_AXIS = 7
SEEN, N_WHOLE = 3 * N_AXIS, 3 * N_AXIS + 1
N_LIMIT = 3 * N_AXIS + 2
"""Columns of the memory. For each axis: the last reading; how many before it were equal; their
mean; share that are equal; the limits found, infinite for none; what was read when the run of
the axis began, summed over the other two. Then: any reading yet; readings in a row within the
scale."""


@small_kernel
def start_limits(q, memory, e, n, x, y, z):
    """Begin with a reading."""
    for a in range(3):
        at = a * N_AXIS
        first = (x, y, z)[a]
        memory[e, n, at + LAST] = first + 1.0  # equal to none
        memory[e, n, at + MEAN], memory[e, n, at + SHARE] = first, q.equal_least
        memory[e, n, at + LOW], memory[e, n, at + HIGH] = -math.inf, math.inf
    memory[e, n, SEEN], memory[e, n, N_WHOLE] = 1.0, q.whole_after


@small_kernel
def is_at_limit(q, memory, e, n, at, x, others, held):
    """Whether the reading of one axis is at its limit.

    Args:
        q: Record of `SanityParams`.
        memory: Updated, (env, node, N_LIMIT).
        e: Environment.
        n: Node.
        at: First column of the axis.
        x: Its reading [m/s2].
        others: Sum of the readings of the other axes [m/s2].
        held: Whether all three are as they were.
    """
    equal = x == memory[e, n, at + LAST]
    run = memory[e, n, at + RUN]
    if not equal:
        run = 0.0
        memory[e, n, at + START] = others
    elif not held:
        run += 1.0
    memory[e, n, at + LAST], memory[e, n, at + RUN] = x, run
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
    """Note which axes are at their limit.

    Args:
        q: Record of `SanityParams`.
        memory: Updated, (env, node, N_LIMIT); zeros before the first sample.
        e: Environment.
        n: Node.
        x: Specific force [m/s2].
        y: Specific force [m/s2], along y.
        z: Specific force [m/s2], along z.

    Returns:
        True for each axis that is cut off; True if the sample tells the tilt.
    """
    if memory[e, n, SEEN] == 0.0:
        start_limits(q, memory, e, n, x, y, z)
    held = (
        x == memory[e, n, LAST]
        and y == memory[e, n, N_AXIS + LAST]
        and z == memory[e, n, 2 * N_AXIS + LAST]
    )
    cut_x = is_at_limit(q, memory, e, n, 0, x, y + z, held)
    cut_y = is_at_limit(q, memory, e, n, N_AXIS, y, z + x, held)
    cut_z = is_at_limit(q, memory, e, n, 2 * N_AXIS, z, x + y, held)
    whole = not (cut_x or cut_y or cut_z)
    memory[e, n, N_WHOLE] = memory[e, n, N_WHOLE] + 1.0 if whole else 0.0
    return cut_x, cut_y, cut_z, memory[e, n, N_WHOLE] >= q.whole_after
