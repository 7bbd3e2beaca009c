"""``D (P - W^T W) D``, the one sum of products that the joint filter's time goes into.

A compiler finds vectors along a row by itself, but not that a square of P can stay in registers
while all rows of W are taken off it, and not how to transpose it there for the other half of P.
So this kernel is put together from vectors by hand (`vectors`); `apply_downdate_plainly` is the
same in plain loops.
"""

from __future__ import annotations

from numba import config, types
from numba.core import cgutils
from numba.extending import intrinsic

from tracking.jit import kernel
from tracking.maths.simd import vectors as vectors
from tracking.maths.simd.vectors import (
    CONTRACT,
    INT,
    load,
    matrix_at,
    row_at,
    spread,
    store,
    transpose,
    vector,
)

WIDE = 2
"""Vectors side by side in a square of P: enough sums at a time to hide how long each takes,
and not more than fit in the registers: a square is twice as wide as high."""


@kernel
def apply_downdate_plainly(P, h, W, g, m, scale):
    """What `apply_downdate` does, in plain loops."""
    n = P.shape[2]
    for r in range(n):
        for k in range(n):
            for q in range(m):
                P[h, r, k] -= W[g, q, r] * W[g, q, k]
            if scale is not None:
                P[h, r, k] *= scale[r] * scale[k]


@intrinsic
def _apply_downdate(context, P, h, W, g, m, scale):
    """The code of `apply_downdate` for whole squares."""
    fades = not isinstance(scale, types.NoneType)

    def generate(target, builder, signature, arguments):
        P, h, W, g, m, scale = arguments
        lanes = vectors.LANES
        states, n = matrix_at(target, builder, signature.args[0], P, h)
        rows, _ = matrix_at(target, builder, signature.args[2], W, g)
        if fades:
            scale = target.make_array(signature.args[5])(target, builder, scale).data
        sums = [[cgutils.alloca_once(builder, vector()) for _ in range(WIDE)] for _ in range(lanes)]

        def square(row, column, wide):
            """Take off LANES rows of P, wide vectors of each; the other half follows."""
            own = [row_at(builder, states, row, i, n) for i in range(lanes)]
            columns = [builder.add(column, INT(lanes * j)) for j in range(wide)]
            each = [(i, j) for i in range(lanes) for j in range(wide)]
            for i, j in each:
                builder.store(load(builder, own[i], columns[j]), sums[i][j])
            with cgutils.for_range(builder, m, intp=INT) as q:
                w = row_at(builder, rows, q.index, 0, n)
                right = [load(builder, w, at) for at in columns]
                left = [spread(builder, w, builder.add(row, INT(i))) for i in range(lanes)]
                for i, j in each:
                    product = builder.fmul(left[i], right[j], flags=CONTRACT)
                    total = builder.fsub(builder.load(sums[i][j]), product, flags=CONTRACT)
                    builder.store(total, sums[i][j])
            if fades:
                keep = [spread(builder, scale, builder.add(row, INT(i))) for i in range(lanes)]
            for j, at in enumerate(columns):
                block = [builder.load(sums[i][j]) for i in range(lanes)]
                if fades:
                    # Of the two first, so that both halves are rounded alike.
                    both = load(builder, scale, at)
                    block = [
                        builder.fmul(total, builder.fmul(one, both))
                        for total, one in zip(block, keep, strict=True)
                    ]
                for i, numbers in enumerate(block):
                    store(builder, numbers, own[i], at)
                for i, numbers in enumerate(transpose(builder, block)):
                    store(builder, numbers, row_at(builder, states, at, i, n), row)

        step, width = INT(lanes), INT(lanes * WIDE)
        with cgutils.for_range_slice(builder, INT(0), n, step, intp=INT) as (row, _):
            whole = builder.sub(n, builder.srem(builder.sub(n, row), width))
            with cgutils.for_range_slice(builder, row, whole, width, intp=INT) as (column, _):
                square(row, column, WIDE)
            with cgutils.for_range_slice(builder, whole, n, step, intp=INT) as (column, _):
                square(row, column, 1)
        return target.get_dummy_value()

    return types.void(P, h, W, g, m, scale), generate


@kernel
def _apply_downdate_in_squares(P, h, W, g, m, scale):
    if P.shape[2] % vectors.LANES:
        apply_downdate_plainly(P, h, W, g, m, scale)
    else:
        _apply_downdate(P, h, W, g, m, scale)


apply_downdate = apply_downdate_plainly if config.DISABLE_JIT else _apply_downdate_in_squares
"""``P[h] - W[g]^T W[g]`` of m rows of W, faded; to the last bit equal across the diagonal.

Args:
    P: Symmetric, (matrix, n, n); fast where n is a multiple of 8.
    h: Matrix.
    W: (matrix, row, n)
    g: Matrix of W.
    m: Rows.
    scale: How much of each error stays, (n): rows and columns are multiplied by it. Or None.
"""
