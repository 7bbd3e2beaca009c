"""One half of a symmetric matrix from the other, square by square.

Copied number by number, a column is read from as many cache lines as it has rows. Here squares are
transposed in registers (`vectors`); `mirror_plainly` is the same in plain loops.
"""

from __future__ import annotations

from numba import config, types
from numba.core import cgutils
from numba.extending import intrinsic

from tracking.jit import kernel
from tracking.maths.simd import vectors as vectors
from tracking.maths.simd.vectors import (
    INT,
    load,
    matrix_at,
    row_at,
    select,
    store,
    transpose,
)


@kernel
def mirror_plainly(P, h, rows):
    """Copy what is right of the diagonal in the first rows of ``P[h]`` to below it."""
    for r in range(rows):
        for k in range(r + 1, P.shape[2]):
            P[h, k, r] = P[h, r, k]


@intrinsic
def _mirror(context, P, h, rows):
    """The code of `mirror` for at least a square."""

    def generate(target, builder, signature, arguments):
        P, h, rows = arguments
        states, n = matrix_at(target, builder, signature.args[0], P, h)
        lanes = vectors.LANES

        def within(at, end):
            """A square that would reach beyond begins earlier: some is copied twice."""
            last = builder.sub(end, INT(lanes))
            return builder.select(builder.icmp_signed(">", at, last), last, at)

        def square(row, column):
            own = [load(builder, row_at(builder, states, row, i, n), column) for i in range(lanes)]
            return own, transpose(builder, own)

        with cgutils.for_range_slice(builder, INT(0), rows, INT(lanes), intp=INT) as (block, _):
            row = within(block, rows)
            own, across = square(row, row)
            for i in range(lanes):
                half = select(builder, own[i], across[i], [k >= i for k in range(lanes)])
                store(builder, half, row_at(builder, states, row, i, n), row)
            right = builder.add(row, INT(lanes))
            with cgutils.for_range_slice(builder, right, n, INT(lanes), intp=INT) as (block, _):
                column = within(block, n)
                _, across = square(row, column)
                for i in range(lanes):
                    store(builder, across[i], row_at(builder, states, column, i, n), row)
        return target.get_dummy_value()

    return types.void(P, h, rows), generate


@kernel
def _mirror_in_squares(P, h, rows):
    if rows < vectors.LANES:
        mirror_plainly(P, h, rows)
    else:
        _mirror(P, h, rows)


mirror = mirror_plainly if config.DISABLE_JIT else _mirror_in_squares
"""Copy what is right of the diagonal in the first rows of ``P[h]`` to below it.

Args:
    P: (matrix, n, n)
    h: Matrix.
    rows: How many.
"""
