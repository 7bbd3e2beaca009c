"""``P - W^T W``, the one sum of products that the joint filter's time goes into.

A compiler finds vectors along a row by itself, but not that a square of P can stay in registers
while all rows of W are taken off it, and not how to transpose it there for the other half of P.
So this kernel is put together from vectors by hand: as many numbers each as a register of this
machine holds. `take_off_plainly` is the same in plain loops.
"""

from __future__ import annotations

import llvmlite.binding
from llvmlite import ir
from numba import config, types
from numba.core import cgutils
from numba.extending import intrinsic

from tracking.compiled import kernel


def _wide_registers():
    """Whether registers of this machine hold eight numbers."""
    try:
        return bool(llvmlite.binding.get_host_cpu_features().get("avx512f"))
    except RuntimeError:  # not told here
        return False


LANES = 8 if _wide_registers() else 4
"""Numbers of a vector: so many that the squares below, twice as wide as high, fit in registers."""
WIDE = 2
"""Vectors side by side in a square of P: enough sums at a time to hide how long each takes."""

_DOUBLE, _INT = ir.DoubleType(), ir.IntType(64)
# Products may be added without being rounded before, where the machine can.
_CONTRACT = ("contract",)


@kernel
def take_off_plainly(P, h, W, g, m):
    """``P[h] - W[g]^T W[g]`` of the first m rows of W, in plain loops."""
    n = P.shape[2]
    for r in range(n):
        for k in range(n):
            for q in range(m):
                P[h, r, k] -= W[g, q, r] * W[g, q, k]


@intrinsic
def _take_off(context, P, h, W, g, m):
    """The code of `take_off` for whole squares."""

    def generate(target, builder, signature, arguments):
        P, h, W, g, m = arguments
        states, n = _matrix(target, builder, signature.args[0], P, h)
        rows, _ = _matrix(target, builder, signature.args[2], W, g)
        sums = [
            [cgutils.alloca_once(builder, _vector()) for _ in range(WIDE)] for _ in range(LANES)
        ]

        def square(row, column, wide):
            """Take off LANES rows of P, wide vectors of each; the other half follows."""
            own = [_row(builder, states, row, i, n) for i in range(LANES)]
            columns = [builder.add(column, _INT(LANES * j)) for j in range(wide)]
            each = [(i, j) for i in range(LANES) for j in range(wide)]
            for i, j in each:
                builder.store(_load(builder, own[i], columns[j]), sums[i][j])
            with cgutils.for_range(builder, m, intp=_INT) as q:
                w = _row(builder, rows, q.index, 0, n)
                right = [_load(builder, w, at) for at in columns]
                left = [_spread(builder, w, builder.add(row, _INT(i))) for i in range(LANES)]
                for i, j in each:
                    product = builder.fmul(left[i], right[j], flags=_CONTRACT)
                    total = builder.fsub(builder.load(sums[i][j]), product, flags=_CONTRACT)
                    builder.store(total, sums[i][j])
            for j, at in enumerate(columns):
                block = [builder.load(sums[i][j]) for i in range(LANES)]
                for i, vector in enumerate(block):
                    _store(builder, vector, own[i], at)
                for i, vector in enumerate(_transpose(builder, block)):
                    _store(builder, vector, _row(builder, states, at, i, n), row)

        step, width = _INT(LANES), _INT(LANES * WIDE)
        with cgutils.for_range_slice(builder, _INT(0), n, step, intp=_INT) as (row, _):
            whole = builder.sub(n, builder.srem(builder.sub(n, row), width))
            with cgutils.for_range_slice(builder, row, whole, width, intp=_INT) as (column, _):
                square(row, column, WIDE)
            with cgutils.for_range_slice(builder, whole, n, step, intp=_INT) as (column, _):
                square(row, column, 1)
        return target.get_dummy_value()

    return types.void(P, h, W, g, m), generate


@kernel
def _take_off_in_squares(P, h, W, g, m):
    if P.shape[2] % LANES:
        take_off_plainly(P, h, W, g, m)
    else:
        _take_off(P, h, W, g, m)


take_off = take_off_plainly if config.DISABLE_JIT else _take_off_in_squares
"""``P[h] - W[g]^T W[g]`` of the first m rows of W; equal across the diagonal to the last bit.

Args:
    P: Symmetric, (matrix, n, n); fast where n is a multiple of 8.
    h: Matrix.
    W: (matrix, row, n)
    g: Matrix of W.
    m: Rows.
"""


def _vector():
    return ir.VectorType(_DOUBLE, LANES)


def _places(numbers):
    """Which of two vectors' numbers make a third."""
    return ir.Constant(ir.VectorType(ir.IntType(32), LANES), numbers)


def _matrix(target, builder, kind, array, index):
    """Where a matrix of an array begins, and how long its rows are."""
    a = target.make_array(kind)(target, builder, array)
    _, height, width = cgutils.unpack_tuple(builder, a.shape)
    at = builder.mul(index, builder.mul(height, width))
    return builder.gep(a.data, [at]), width


def _row(builder, matrix, row, below, length):
    """Where a row begins, so many below another."""
    return builder.gep(matrix, [builder.mul(builder.add(row, _INT(below)), length)])


def _load(builder, row, at):
    """A vector, from any address."""
    address = builder.bitcast(builder.gep(row, [at]), _vector().as_pointer())
    return builder.load(address, align=8)


def _store(builder, vector, row, at):
    address = builder.bitcast(builder.gep(row, [at]), _vector().as_pointer())
    builder.store(vector, address, align=8)


def _spread(builder, row, at):
    """A vector of one number."""
    nothing = ir.Constant(_vector(), ir.Undefined)
    first = builder.insert_element(nothing, builder.load(builder.gep(row, [at])), _INT(0))
    return builder.shuffle_vector(first, nothing, _places([0] * LANES))


def _transpose(builder, block):
    """LANES vectors across: halves change places, then halves of halves."""
    block, half = list(block), LANES // 2
    while half:
        for i in range(LANES):
            if not i & half:
                upper, lower = block[i], block[i + half]
                left = [LANES + k - half if k & half else k for k in range(LANES)]
                right = [LANES + k if k & half else k + half for k in range(LANES)]
                block[i] = builder.shuffle_vector(upper, lower, _places(left))
                block[i + half] = builder.shuffle_vector(upper, lower, _places(right))
        half //= 2
    return block
