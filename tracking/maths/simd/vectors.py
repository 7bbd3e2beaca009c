"""Vectors of numbers, for the sums that compiled loops are too slow for.

A compiler finds vectors along a row by itself, but not that many sums can stay in registers while
all that belongs to them is added, and not how to transpose a square there. Kernels that need it are
put together from these, as many numbers each as a register of this machine holds, and each has a
twin in plain loops.
"""

from __future__ import annotations

import llvmlite.binding
from llvmlite import ir
from numba.core import cgutils


def _wide_registers():
    """Whether registers of this machine hold eight numbers."""
    try:
        return bool(llvmlite.binding.get_host_cpu_features().get("avx512f"))
    except RuntimeError:  # unknown here
        return False


LANES = 8 if _wide_registers() else 4
"""Numbers of a vector."""

DOUBLE, INT = ir.DoubleType(), ir.IntType(64)
# Products may be added without being rounded before, where the machine can.
CONTRACT = ("contract",)


def vector():
    """Its type."""
    return ir.VectorType(DOUBLE, LANES)


def _places(numbers):
    """Which of two vectors' numbers make a third."""
    return ir.Constant(ir.VectorType(ir.IntType(32), LANES), numbers)


def matrix_at(target, builder, kind, array, index):
    """Where a matrix of an array begins, and how long its rows are."""
    a = target.make_array(kind)(target, builder, array)
    _, height, width = cgutils.unpack_tuple(builder, a.shape)
    at = builder.mul(index, builder.mul(height, width))
    return builder.gep(a.data, [at]), width


def row_at(builder, matrix, row, below, length):
    """Where a row begins, so many below another."""
    return builder.gep(matrix, [builder.mul(builder.add(row, INT(below)), length)])


def load(builder, row, at):
    """A vector, from any address."""
    address = builder.bitcast(builder.gep(row, [at]), vector().as_pointer())
    return builder.load(address, align=8)


def store(builder, numbers, row, at):
    """Write a vector, to any address."""
    address = builder.bitcast(builder.gep(row, [at]), vector().as_pointer())
    builder.store(numbers, address, align=8)


def spread(builder, row, at):
    """A vector of one number, again and again."""
    nothing = ir.Constant(vector(), ir.Undefined)
    first = builder.insert_element(nothing, builder.load(builder.gep(row, [at])), INT(0))
    return builder.shuffle_vector(first, nothing, _places([0] * LANES))


def select(builder, one, other, from_one):
    """Numbers of one vector where it is said so, and of another."""
    numbers = [k if mine else LANES + k for k, mine in enumerate(from_one)]
    return builder.shuffle_vector(one, other, _places(numbers))


def transpose(builder, block):
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
