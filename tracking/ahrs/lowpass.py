"""Second-order Butterworth low pass over several signals, initialised with their mean.

    y = b0 x + u,    u' = b1 x - a1 y + w,    w' = b2 x - a2 y

The first samples, for one time constant, are averaged; the filter then continues from their
mean as its steady state [1], sec. 3.2, so no single first sample dominates.

References:
    [1] Laidig, Seel, VQF: Highly accurate IMU orientation estimation with bias estimation and
        magnetic disturbance rejection, Information Fusion 91 (2023) 187.
"""

from __future__ import annotations

from tracking.kernels.jit import small_kernel

B0, B1, B2, A1, A2, N_MEAN = 0, 1, 2, 3, 4, 5
N_LOW_PASS = 6
"""Columns of a filter's coefficients: numerator, denominator, number of averaged samples."""


@small_kernel
def low_pass(memory, e, n, at, size, count, filters, row):
    """Filter signals in place.

    Args:
        memory: (env, node, column). From column `at`: `size` inputs, which become the outputs,
            and 2 `size` filter states; zeros before the first sample.
        e: Environment.
        n: Node.
        at: First column of the inputs.
        size: Number of signals.
        count: Number of this sample, the first is 1.
        filters: Coefficients, (row, N_LOW_PASS).
        row: Row of the coefficients.
    """
    b0, b1, b2 = filters[row, B0], filters[row, B1], filters[row, B2]
    a1, a2 = filters[row, A1], filters[row, A2]
    u, w = at + size, at + 2 * size
    if count > filters[row, N_MEAN]:
        for k in range(size):
            x = memory[e, n, at + k]
            y = b0 * x + memory[e, n, u + k]
            memory[e, n, u + k] = b1 * x - a1 * y + memory[e, n, w + k]
            memory[e, n, w + k] = b2 * x - a2 * y
            memory[e, n, at + k] = y
    else:
        for k in range(size):
            total = memory[e, n, w + k] + memory[e, n, at + k]
            mean = total / count
            memory[e, n, at + k] = mean
            memory[e, n, w + k] = total
            if count == filters[row, N_MEAN]:
                memory[e, n, u + k] = mean * (1.0 - b0)
                memory[e, n, w + k] = mean * (b2 - a2)
