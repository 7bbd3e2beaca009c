"""Covariance operations that take most of the time: with SIMD vectors, or in plain loops.

Both give the same up to rounding; SIMD takes half the time or less. Its code is generated from
LLVM instructions (`covariance_simd`), which may not suit every machine: set `RELPOS_SIMD=0` in the
environment, before the package is imported, to use plain loops.

    sum_rows(P, h, idx, val, m, W, share, q, w)
        w = sum_k val_k P[h, idx_k] - sum_k share_k W[h, k]    for m rows of P, q rows of W
    add_to_rows(P, h, p, b, m, F, i)                            P[h] <- F P
        Add to the rows of position and velocity of node i, which begin at state p, those of the m
        states from b on, times gains: `F[i, k, r]` is the gain of row r by state k, `F[i, STATES,
        r]`, the time, that of a position by its velocity. m is 3 in the plane, 4 or 7 in space.
    add_to_columns(P, h, p, b, m, F, i)                         P[h] <- P F^T
        Add to the columns with the same gains, down to the last row of the velocity.
    apply_downdate(P, h, W, g, m, scale)                        P[h] <- D (P - W^T W) D
        W is m rows of W[g]; the result is exactly symmetric; D = diag(scale), or 1 for None.
    subtract_square(P, h, w)                                    P[h] <- P - w w^T
    mirror(P, h, rows)
        Copy the upper triangle of the first rows of P[h] to the lower triangle.

P is (matrix, n, n), W (matrix, row, n), F (node, STATES + 1, ROOM).
"""

from __future__ import annotations

import os

from numba import config

from tracking.kernels.jit import kernel, small_kernel
from tracking.maths import covariance_loops as loops
from tracking.maths import covariance_simd as simd
from tracking.maths import vectors
from tracking.maths.covariance_loops import ROOM, STATES

USES_SIMD = os.environ.get("RELPOS_SIMD", "1") != "0" and not config.DISABLE_JIT
"""True if SIMD is used for matrices of a suitable size."""


@small_kernel
def _sum_rows(P, h, idx, val, m, W, share, q, w):
    if P.shape[2] < simd.SHORT:
        loops.sum_rows(P, h, idx, val, m, W, share, q, w)
    else:
        simd.sum_rows(P, h, idx, val, m, W, share, q, w)


@kernel
def _add_to_rows(P, h, p, b, m, F, i):
    if P.shape[2] % vectors.LANES:
        loops.add_to_rows(P, h, p, b, m, F, i)
    else:
        simd.add_to_rows(P, h, p, b, m, F, i)


@kernel
def _add_to_columns(P, h, p, b, m, F, i):
    if P.shape[2] % vectors.LANES:
        loops.add_to_columns(P, h, p, b, m, F, i)
    else:
        simd.add_to_columns(P, h, p, b, m, F, i)


@kernel
def _apply_downdate(P, h, W, g, m, scale):
    if P.shape[2] % vectors.LANES:
        loops.apply_downdate(P, h, W, g, m, scale)
    else:
        simd.apply_downdate(P, h, W, g, m, scale)


@small_kernel
def _subtract_square(P, h, w):
    if P.shape[2] % vectors.LANES:
        loops.subtract_square(P, h, w)
    else:
        simd.subtract_square(P, h, w)


@kernel
def _mirror(P, h, rows):
    whole = 0 if P.shape[2] % vectors.LANES else rows - rows % vectors.LANES
    simd.mirror(P, h, whole)
    loops.mirror(P, h, rows, whole)


sum_rows = _sum_rows if USES_SIMD else loops.sum_rows
add_to_rows = _add_to_rows if USES_SIMD else loops.add_to_rows
add_to_columns = _add_to_columns if USES_SIMD else loops.add_to_columns
apply_downdate = _apply_downdate if USES_SIMD else loops.apply_downdate
subtract_square = _subtract_square if USES_SIMD else loops.subtract_square
mirror = _mirror if USES_SIMD else loops.mirror

__all__ = [
    "ROOM",
    "STATES",
    "USES_SIMD",
    "add_to_columns",
    "add_to_rows",
    "apply_downdate",
    "mirror",
    "subtract_square",
    "sum_rows",
]
