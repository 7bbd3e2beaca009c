"""``P H`` of a measurement, pending updates applied: the first step of every update.

A weighted sum of rows, those of P that the measurement looks at and those that wait. Compiled loops
load and store it again for every few rows. Here a stretch of it stays in registers
(`vectors`) until all rows are added; `sum_rows_plainly` is the same in plain loops.
"""

from __future__ import annotations

from numba import config, types
from numba.core import cgutils
from numba.extending import intrinsic

from tracking.jit import kernel, small_kernel
from tracking.maths.simd import vectors as vectors
from tracking.maths.simd.vectors import (
    CONTRACT,
    INT,
    load,
    matrix_at,
    row_at,
    spread,
    store,
    vector,
)

LONG, SHORT = 48, 16
"""Numbers that are summed at a time: as many as registers hold, or few where rows are short."""


@kernel
def sum_rows_plainly(P, h, idx, val, m, W, share, q, w):
    """``sum_k val_k P[h, idx_k] - sum_k share_k W[h, k]`` of m and q rows, in plain loops."""
    for r in range(P.shape[2]):
        w[r] = 0.0
    for k in range(m):
        for r in range(P.shape[2]):
            w[r] += val[k] * P[h, idx[k], r]
    for k in range(q):
        for r in range(P.shape[2]):
            w[r] -= share[k] * W[h, k, r]


@intrinsic
def _sum_rows(context, P, h, idx, val, m, W, share, q, w):
    """The code of `sum_rows` for at least a short stretch."""

    def generate(target, builder, signature, arguments):
        P, h, idx, val, m, W, share, q, w = arguments
        kinds = signature.args
        states, n = matrix_at(target, builder, kinds[0], P, h)
        waiting, _ = matrix_at(target, builder, kinds[5], W, h)
        idx, val, share, w = (
            target.make_array(kinds[k])(target, builder, array).data
            for k, array in ((2, idx), (3, val), (6, share), (8, w))
        )
        lanes = vectors.LANES
        nothing = vector()([0.0] * lanes)
        sums = [cgutils.alloca_once(builder, vector()) for _ in range(LONG // lanes)]

        def stretch(column, totals):
            """All rows of one stretch."""
            at = [builder.add(column, INT(lanes * j)) for j in range(len(totals))]
            for total in totals:
                builder.store(nothing, total)
            with cgutils.for_range(builder, m, intp=INT) as k:
                row = row_at(builder, states, builder.load(builder.gep(idx, [k.index])), 0, n)
                add(row, spread(builder, val, k.index), zip(totals, at, strict=True), builder.fadd)
            with cgutils.for_range(builder, q, intp=INT) as k:
                row = row_at(builder, waiting, k.index, 0, n)
                add(
                    row, spread(builder, share, k.index), zip(totals, at, strict=True), builder.fsub
                )
            for total, place in zip(totals, at, strict=True):
                store(builder, builder.load(total), w, place)

        def add(row, weight, totals, operation):
            for total, place in totals:
                product = builder.fmul(weight, load(builder, row, place), flags=CONTRACT)
                changed = operation(builder.load(total), product, flags=CONTRACT)
                builder.store(changed, total)

        def stretches(length):
            """A row. Its last stretch ends with it: some numbers are summed twice, to the same."""
            last, step = builder.sub(n, INT(length)), INT(length)
            with cgutils.for_range_slice(builder, INT(0), n, step, intp=INT) as (column, _):
                beyond = builder.icmp_signed(">", column, last)
                stretch(builder.select(beyond, last, column), sums[: length // lanes])

        with builder.if_else(builder.icmp_signed(">=", n, INT(LONG))) as (then, otherwise):
            with then:
                stretches(LONG)
            with otherwise:
                stretches(SHORT)
        return target.get_dummy_value()

    return types.void(P, h, idx, val, m, W, share, q, w), generate


@small_kernel
def _sum_rows_in_stretches(P, h, idx, val, m, W, share, q, w):
    if P.shape[2] < SHORT:
        sum_rows_plainly(P, h, idx, val, m, W, share, q, w)
    else:
        _sum_rows(P, h, idx, val, m, W, share, q, w)


sum_rows = sum_rows_plainly if config.DISABLE_JIT else _sum_rows_in_stretches
"""Write ``sum_k val_k P[h, idx_k] - sum_k share_k W[h, k]``.

Args:
    P: (matrix, n, n)
    h: Matrix of P and of W.
    idx: Rows of P.
    val: Their weights.
    m: How many.
    W: (matrix, row, n)
    share: Weights of its first rows.
    q: How many.
    w: The sum, (n), written.
"""
