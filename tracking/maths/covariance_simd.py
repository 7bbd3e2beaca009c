"""The operations of `covariance` in SIMD vectors, as many elements at a time as a register holds.

A compiler vectorises along a row by itself, but does not keep many sums in registers while all
their terms are added, and does not transpose a block there. `covariance_loops` has the same
operations in plain loops.
"""

from __future__ import annotations

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from tracking.maths import vectors
from tracking.maths.covariance_loops import STATES
from tracking.maths.vectors import (
    INT,
    load,
    matrix_at,
    row_at,
    spread,
    store,
    store_transposed,
    transpose,
    vector,
)

LONG, SHORT = 48, 16
"""Elements of a row that are summed at a time: as many as registers hold, or few in short rows."""
WIDE = 2
"""Vectors side by side in a block of P: enough sums at a time to hide the latency of each."""
SHAPES = ((2, 3), (3, 4), (3, 7))
"""Dimensions, and states after position and velocity: the plane, space, space with an offset."""
CONTRACT = ("contract",)  # allows fused multiply-add


@intrinsic
def sum_rows(context, P, h, idx, val, m, W, share, q, w):
    """Generate the code of `sum_rows` for rows of at least SHORT elements."""

    def generate(target, builder, signature, arguments):
        P, h, idx, val, m, W, share, q, w = arguments
        kinds = signature.args
        states, n = matrix_at(target, builder, kinds[0], P, h)
        waiting, _ = matrix_at(target, builder, kinds[5], W, h)
        idx, val, share, w = (
            target.make_array(kinds[k])(target, builder, array).data
            for k, array in ((2, idx), (3, val), (6, share), (8, w))
        )
        nothing = vector()([0.0] * vectors.LANES)
        sums = [cgutils.alloca_once(builder, vector()) for _ in range(LONG // vectors.LANES)]

        def stretch(column, totals):
            """Sum one stretch of all rows."""
            at = [builder.add(column, INT(vectors.LANES * j)) for j in range(len(totals))]
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
            """Sum whole rows. The last stretch ends with the row and may overlap the one before."""
            last, step = builder.sub(n, INT(length)), INT(length)
            with cgutils.for_range_slice(builder, INT(0), n, step, intp=INT) as (column, _):
                beyond = builder.icmp_signed(">", column, last)
                stretch(builder.select(beyond, last, column), sums[: length // vectors.LANES])

        with builder.if_else(builder.icmp_signed(">=", n, INT(LONG))) as (then, otherwise):
            with then:
                stretches(LONG)
            with otherwise:
                stretches(SHORT)
        return target.get_dummy_value()

    return types.void(P, h, idx, val, m, W, share, q, w), generate


def _counts(d, m, r, q):
    """Return whether row r has a gain by state q."""
    upright, rises = q == 2 and d == 3, r % d == 2
    if m == STATES:
        return rises or not upright
    return rises == upright


def _for_each_shape(builder, m, generate):
    """Generate the code of every shape; the number of states selects the one that runs."""
    for d, states in SHAPES:
        with builder.if_then(builder.icmp_signed("==", m, INT(states))):
            generate(d, states)


def _add_product(builder, total, one, other):
    return builder.fadd(total, builder.fmul(one, other, flags=CONTRACT), flags=CONTRACT)


@intrinsic
def add_to_rows(context, P, h, p, b, m, F, i):
    """Generate the code of `add_to_rows` for rows of whole vectors."""

    def generate(target, builder, signature, arguments):
        P, h, p, b, m, F, i = arguments
        states, n = matrix_at(target, builder, signature.args[0], P, h)
        gains, room = matrix_at(target, builder, signature.args[5], F, i)

        def gain(q, r):
            return spread(builder, row_at(builder, gains, INT(q), 0, room), INT(r))

        def add(d, m):
            time = gain(STATES, 0)
            each = [[q for q in range(m) if _counts(d, m, r, q)] for r in range(2 * d)]
            weights = [{q: gain(q, r) for q in each[r]} for r in range(2 * d)]
            step = INT(vectors.LANES)
            with cgutils.for_range_slice(builder, INT(0), n, step, intp=INT) as (column, _):
                own = [row_at(builder, states, p, r, n) for r in range(2 * d)]
                behind = [row_at(builder, states, b, q, n) for q in range(m)]
                known = [load(builder, row, column) for row in behind]
                totals = [load(builder, row, column) for row in own]
                for r in range(d):
                    totals[r] = _add_product(builder, totals[r], time, totals[d + r])
                for r in range(2 * d):
                    for q, weight in weights[r].items():
                        totals[r] = _add_product(builder, totals[r], weight, known[q])
                    store(builder, totals[r], own[r], column)

        _for_each_shape(builder, m, add)
        return target.get_dummy_value()

    return types.void(P, h, p, b, m, F, i), generate


@intrinsic
def add_to_columns(context, P, h, p, b, m, F, i):
    """Generate the code of `add_to_columns`; gains of later elements in a vector are zero."""

    def generate(target, builder, signature, arguments):
        P, h, p, b, m, F, i = arguments
        states, n = matrix_at(target, builder, signature.args[0], P, h)
        gains, room = matrix_at(target, builder, signature.args[5], F, i)

        def add(d, m):
            parts = range(0, 2 * d, vectors.LANES)
            lines = [row_at(builder, gains, INT(q), 0, room) for q in range(STATES + 1)]
            weights = [[load(builder, line, INT(at)) for at in parts] for line in lines]
            end = builder.add(p, INT(2 * d))
            with cgutils.for_range(builder, end, intp=INT) as r:
                row = row_at(builder, states, r.index, 0, n)
                known = [spread(builder, row, builder.add(b, INT(q))) for q in range(m)]
                totals = []
                for j, at in enumerate(parts):
                    total = load(builder, row, builder.add(p, INT(at)))
                    if at < d:
                        velocity = load(builder, row, builder.add(p, INT(d + at)))
                        total = _add_product(builder, total, weights[STATES][j], velocity)
                    for q in range(m):
                        total = _add_product(builder, total, weights[q][j], known[q])
                    totals.append(total)
                for total, at in zip(totals, parts, strict=True):
                    store(builder, total, row, builder.add(p, INT(at)))

        _for_each_shape(builder, m, add)
        return target.get_dummy_value()

    return types.void(P, h, p, b, m, F, i), generate


@intrinsic
def apply_downdate(context, P, h, W, g, m, scale):
    """Generate the code of `apply_downdate` for whole blocks."""
    fades = not isinstance(scale, types.NoneType)

    def generate(target, builder, signature, arguments):
        P, h, W, g, m, scale = arguments
        states, n = matrix_at(target, builder, signature.args[0], P, h)
        rows, _ = matrix_at(target, builder, signature.args[2], W, g)
        if fades:
            scale = target.make_array(signature.args[5])(target, builder, scale).data
        lanes = range(vectors.LANES)
        sums = [[cgutils.alloca_once(builder, vector()) for _ in range(WIDE)] for _ in lanes]

        def square(row, column, wide):
            """Downdate `wide` vectors of LANES rows of P; copy the result to the other half."""
            own = [row_at(builder, states, row, i, n) for i in lanes]
            columns = [builder.add(column, INT(vectors.LANES * j)) for j in range(wide)]
            each = [(i, j) for i in lanes for j in range(wide)]
            for i, j in each:
                builder.store(load(builder, own[i], columns[j]), sums[i][j])
            with cgutils.for_range(builder, m, intp=INT) as q:
                w = row_at(builder, rows, q.index, 0, n)
                right = [load(builder, w, at) for at in columns]
                left = [spread(builder, w, builder.add(row, INT(i))) for i in lanes]
                for i, j in each:
                    product = builder.fmul(left[i], right[j], flags=CONTRACT)
                    total = builder.fsub(builder.load(sums[i][j]), product, flags=CONTRACT)
                    builder.store(total, sums[i][j])
            if fades:
                keep = [
                    spread(builder, scale, builder.add(row, INT(i))) for i in range(vectors.LANES)
                ]
            for j, at in enumerate(columns):
                block = [builder.load(sums[i][j]) for i in lanes]
                if fades:
                    # The product of both factors first, so that both halves are rounded alike.
                    both = load(builder, scale, at)
                    block = [
                        builder.fmul(total, builder.fmul(one, both))
                        for total, one in zip(block, keep, strict=True)
                    ]
                for i, numbers in enumerate(block):
                    store(builder, numbers, own[i], at)
                store_transposed(builder, block, states, at, n, row)

        step, width = INT(vectors.LANES), INT(vectors.LANES * WIDE)
        with cgutils.for_range_slice(builder, INT(0), n, step, intp=INT) as (row, _):
            whole = builder.sub(n, builder.srem(builder.sub(n, row), width))
            with cgutils.for_range_slice(builder, row, whole, width, intp=INT) as (column, _):
                square(row, column, WIDE)
            with cgutils.for_range_slice(builder, whole, n, step, intp=INT) as (column, _):
                square(row, column, 1)
        return target.get_dummy_value()

    return types.void(P, h, W, g, m, scale), generate


@intrinsic
def mirror(context, P, h, rows):
    """Generate the code of `mirror` for whole blocks of rows."""

    def generate(target, builder, signature, arguments):
        P, h, rows = arguments
        states, n = matrix_at(target, builder, signature.args[0], P, h)
        step, lanes = INT(vectors.LANES), range(vectors.LANES)
        flags = ir.VectorType(ir.IntType(1), vectors.LANES)
        with cgutils.for_range_slice(builder, INT(0), rows, step, intp=INT) as (row, _):
            own = [row_at(builder, states, row, i, n) for i in lanes]
            block = [load(builder, one, row) for one in own]
            for i, numbers in enumerate(transpose(builder, block)):
                below = ir.Constant(flags, [k < i for k in lanes])
                store(builder, builder.select(below, numbers, block[i]), own[i], row)
            right = builder.add(row, step)
            with cgutils.for_range_slice(builder, right, n, step, intp=INT) as (column, _):
                block = [load(builder, one, column) for one in own]
                store_transposed(builder, block, states, column, n, row)
        return target.get_dummy_value()

    return types.void(P, h, rows), generate


@intrinsic
def subtract_square(context, P, h, w):
    """Generate the code of `subtract_square` for whole blocks."""

    def generate(target, builder, signature, arguments):
        P, h, w = arguments
        states, n = matrix_at(target, builder, signature.args[0], P, h)
        w, step = target.make_array(signature.args[2])(target, builder, w).data, INT(vectors.LANES)
        with cgutils.for_range_slice(builder, INT(0), n, step, intp=INT) as (row, _):
            own = [row_at(builder, states, row, i, n) for i in range(vectors.LANES)]
            left = [spread(builder, w, builder.add(row, INT(i))) for i in range(vectors.LANES)]
            with cgutils.for_range_slice(builder, INT(0), n, step, intp=INT) as (column, _):
                right = load(builder, w, column)
                for line, one in zip(own, left, strict=True):
                    total = builder.fsub(load(builder, line, column), builder.fmul(one, right))
                    store(builder, total, line, column)
        return target.get_dummy_value()

    return types.void(P, h, w), generate
