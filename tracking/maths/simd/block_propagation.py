"""``F P F^T`` of one node's step: rows of position and velocity, then their columns.

Both gain what the states behind them are worth, which stand one after another: bias, offset if
there is one, heading error. Compiled loops go through rows number by number and through columns
with nothing side by side. Here all numbers of a node are summed in registers (`vectors`);
`add_to_rows_plainly` and `add_to_columns_plainly` are the same in plain loops.

F is an array (node, STATES + 1, ROOM): what each row of position and velocity gains by each state,
and in the last line what a position gains by its velocity, the time; zero behind them.
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
)

STATES, ROOM = 7, 8
"""States behind position and velocity, at most; numbers of a line of F."""
SHAPES = ((2, 3), (3, 4), (3, 7))
"""Dimensions, and how many such states: in the plane, in space, in space with an offset."""


@kernel
def add_to_rows_plainly(P, h, p, b, m, F, i):
    """What `add_to_rows` does, in plain loops."""
    d = 2 if m == 3 else 3
    for k in range(P.shape[2]):
        for r in range(2 * d):
            if r < d:
                P[h, p + r, k] += F[i, STATES, r] * P[h, p + d + r, k]
            for q in range(m):
                P[h, p + r, k] += F[i, q, r] * P[h, b + q, k]


@kernel
def add_to_columns_plainly(P, h, p, b, m, F, i):
    """What `add_to_columns` does, in plain loops."""
    d = 2 if m == 3 else 3
    for k in range(p + 2 * d):
        for r in range(2 * d):
            if r < d:
                P[h, k, p + r] += F[i, STATES, r] * P[h, k, p + d + r]
            for q in range(m):
                P[h, k, p + r] += F[i, q, r] * P[h, k, b + q]


def _counts(d, m, r, q):
    """Whether row r gains anything by state q."""
    upright, rises = q == 2 and d == 3, r % d == 2
    if m == STATES:
        return rises or not upright
    return rises == upright


def _for_each_shape(builder, m, generate):
    """The code of every shape; which of it runs is known by the number of states."""
    for d, states in SHAPES:
        with builder.if_then(builder.icmp_signed("==", m, INT(states))):
            generate(d, states)


def _add_product(builder, total, one, other):
    return builder.fadd(total, builder.fmul(one, other, flags=CONTRACT), flags=CONTRACT)


@intrinsic
def _add_to_rows(context, P, h, p, b, m, F, i):
    """The code of `add_to_rows` for whole vectors."""

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
def _add_to_columns(context, P, h, p, b, m, F, i):
    """The code of `add_to_columns`. What stands behind them in a vector gains nothing."""

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


@kernel
def _add_to_rows_in_vectors(P, h, p, b, m, F, i):
    if P.shape[2] % vectors.LANES:
        add_to_rows_plainly(P, h, p, b, m, F, i)
    else:
        _add_to_rows(P, h, p, b, m, F, i)


@kernel
def _add_to_columns_in_vectors(P, h, p, b, m, F, i):
    if P.shape[2] % vectors.LANES:
        add_to_columns_plainly(P, h, p, b, m, F, i)
    else:
        _add_to_columns(P, h, p, b, m, F, i)


add_to_rows = add_to_rows_plainly if config.DISABLE_JIT else _add_to_rows_in_vectors
"""``F P``: the rows of position and velocity of one node.

Args:
    P: (matrix, n, n); fast where n is a multiple of 8.
    h: Matrix.
    p: First state of the position; the velocity is behind it.
    b: First of the states by which both change, behind all positions and velocities.
    m: How many, one of `SHAPES`.
    F: (node, STATES + 1, ROOM)
    i: Node.
"""

add_to_columns = add_to_columns_plainly if config.DISABLE_JIT else _add_to_columns_in_vectors
"""The same for the columns, down to the last row of the velocity; what it takes is the same."""
