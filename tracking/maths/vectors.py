"""SIMD vectors in generated code: load, store, broadcast and transpose."""

from __future__ import annotations

from llvmlite import ir
from numba.core import cgutils

from tracking.kernels.processors import has_wide_registers

LANES = 8 if has_wide_registers() else 4
"""Number of elements of a vector."""
DOUBLE, INT = ir.DoubleType(), ir.IntType(64)


def vector():
    """Return the type of a vector."""
    return ir.VectorType(DOUBLE, LANES)


def _places(numbers):
    """Return the mask that shuffles elements of two vectors into a third."""
    return ir.Constant(ir.VectorType(ir.IntType(32), LANES), numbers)


def matrix_at(target, builder, kind, array, index):
    """Return the address of a matrix of an array, and the length of its rows."""
    a = target.make_array(kind)(target, builder, array)
    _, height, width = cgutils.unpack_tuple(builder, a.shape)
    at = builder.mul(index, builder.mul(height, width))
    return builder.gep(a.data, [at]), width


def row_at(builder, matrix, row, below, length):
    """Return the address of the row that is `below` rows after another."""
    return builder.gep(matrix, [builder.mul(builder.add(row, INT(below)), length)])


def load(builder, row, at):
    """Load a vector from an address that need not be aligned."""
    address = builder.bitcast(builder.gep(row, [at]), vector().as_pointer())
    return builder.load(address, align=8)


def store(builder, numbers, row, at):
    """Store a vector at an address that need not be aligned."""
    address = builder.bitcast(builder.gep(row, [at]), vector().as_pointer())
    builder.store(numbers, address, align=8)


def spread(builder, row, at):
    """Broadcast one element of a row to a vector."""
    nothing = ir.Constant(vector(), ir.Undefined)
    first = builder.insert_element(nothing, builder.load(builder.gep(row, [at])), INT(0))
    return builder.shuffle_vector(first, nothing, _places([0] * LANES))


def transpose(builder, block):
    """Transpose a block of LANES vectors: exchange halves, then halves of halves."""
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


def store_transposed(builder, block, matrix, row, length, at):
    """Store a transposed block in the rows from `row` on, at one column."""
    for i, numbers in enumerate(transpose(builder, block)):
        store(builder, numbers, row_at(builder, matrix, row, i, length), at)
