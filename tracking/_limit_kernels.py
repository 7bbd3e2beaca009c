"""Axes of an accelerometer at the end of their scale: flat tops in a lively signal.

An axis that is cut off repeats one number, the largest or the smallest that it reads. A run of
equal readings is taken for that once it is longer than chance makes them, which depends on how
the sensor rounds and is learned from the readings themselves, and if it lies away from their
mean. The limit is then known: single readings of it count as well, until one goes beyond. An
axis that repeats itself for long while another changes is taken for the same: it may have been
beyond its limit from the beginning. Readings that are equal in all axes are none of this: they
stand for some that were lost.
"""

from __future__ import annotations

import math

from tracking.compiled import kernel

CHANCE = math.log(1e-5)
"""[-] A run of equal readings is chance as long as it is more likely than this."""
RARE, COMMON = 0.02, 0.9
"""[-] Share of readings that are equal to the one before: between these, however few came."""
MEMORY, RECENT = 500.0, 100.0
"""[-] Readings over which that share, and the mean of the axis, are taken."""
AWAY = 0.5
"""[m/s2] A limit is at least so far from the mean."""
LONG, CHANGE = 20, 1.0
"""[-], [m/s2] An axis that repeats itself so often while another changes so much is cut off."""
SEEN, LAST, RUN, MEAN, SHARE, LOW, HIGH, START = 0, 1, 2, 3, 4, 5, 6, 7
N_LIMIT = 8
"""Columns of the memory: any reading yet; the last; how many before it were equal; their mean;
share that are equal; the limits found, infinite for none; what was read when the run of
the axis began, summed over the other two."""


@kernel
def find_limits(memory, samples, out):
    """Note which readings are at the limit of their axis.

    Args:
        memory: Of the node, updated, (axis, N_LIMIT); zeros before the first sample.
        samples: Specific force, (sample, 3) [m/s2].
        out: Written, True at a limit, (sample, 3).
    """
    for k in range(samples.shape[0]):
        held = True
        for a in range(3):
            held = held and memory[a, SEEN] != 0.0 and samples[k, a] == memory[a, LAST]
        for a in range(3):
            x, m = samples[k, a], memory[a]
            one, other = samples[k, (a + 1) % 3], samples[k, (a + 2) % 3]
            if m[SEEN] == 0.0:
                m[SEEN], m[LAST], m[MEAN], m[SHARE] = 1.0, x + 1.0, x, RARE
                m[LOW], m[HIGH] = -math.inf, math.inf
            equal = x == m[LAST]
            if not equal:
                m[RUN], m[START] = 0.0, one + other
            elif not held:
                m[RUN] += 1.0
            m[LAST] = x
            if x > m[HIGH] or x < m[LOW]:
                m[LOW], m[HIGH] = -math.inf, math.inf
            rare = min(max(m[SHARE], RARE), COMMON)
            if m[RUN] * math.log(rare) < CHANCE and abs(x - m[MEAN]) > AWAY:
                if x > m[MEAN]:
                    m[HIGH] = x
                else:
                    m[LOW] = x
            if m[RUN] >= LONG and abs(one + other - m[START]) > CHANGE:
                m[LOW], m[HIGH] = x, x
            out[k, a] = x == m[LOW] or x == m[HIGH]
            if not out[k, a]:
                m[SHARE] += ((1.0 if equal else 0.0) - m[SHARE]) / MEMORY
                m[MEAN] += (x - m[MEAN]) / RECENT
