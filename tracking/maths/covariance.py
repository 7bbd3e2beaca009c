"""The sums over a covariance that most of the time goes into: hand-made vectors, or plain loops.

Both give the same up to rounding; the vectors take half the time or less. They are put together
from instructions of LLVM (`covariance_simd`), which is not for every taste or machine: set
`RELPOS_SIMD=0` in the environment, before the package is imported, to do without them.

    sum_rows(P, h, idx, val, m, W, share, q, w)
        w = sum_k val_k P[h, idx_k] - sum_k share_k W[h, k]    of m rows of P, q rows of W
    add_to_rows(P, h, p, b, m, F, i)                            P[h] <- F P
        Position and velocity of node i, which begin at state p, gain what the m states from b on
        are worth: `F[i, k, r]` is what row r gains by state k, and `F[i, STATES, r]`, the time,
        what a position gains by its velocity. m is 3 in the plane, 4 or 7 in space.
    add_to_columns(P, h, p, b, m, F, i)                         P[h] <- P F^T
        The same for the columns, down to the last row of the velocity.
    apply_downdate(P, h, W, g, m, scale)                        P[h] <- D (P - W^T W) D
        Of m rows of W[g], symmetric to the last bit; D = diag(scale), 1 for None.
    mirror(P, h, rows)
        Copy what is right of the diagonal in the first rows of P[h] to below it.

P is (matrix, n, n), W (matrix, row, n), F (node, STATES + 1, ROOM).
"""

from __future__ import annotations

import os

from numba import config

from tracking.kernels.jit import kernel, small_kernel
from tracking.maths import covariance_loops as loops
from tracking.maths import covariance_simd as simd
from tracking.maths.covariance_loops import ROOM, STATES, mirror

USES_SIMD = os.environ.get("RELPOS_SIMD", "1") != "0" and not config.DISABLE_JIT
"""Whether the sums are in vectors where these are whole."""


@small_kernel
def _sum_rows(P, h, idx, val, m, W, share, q, w):
    if P.shape[2] < simd.SHORT:
        loops.sum_rows(P, h, idx, val, m, W, share, q, w)
    else:
        simd.sum_rows(P, h, idx, val, m, W, share, q, w)


@kernel
def _add_to_rows(P, h, p, b, m, F, i):
    if P.shape[2] % simd.LANES:
        loops.add_to_rows(P, h, p, b, m, F, i)
    else:
        simd.add_to_rows(P, h, p, b, m, F, i)


@kernel
def _add_to_columns(P, h, p, b, m, F, i):
    if P.shape[2] % simd.LANES:
        loops.add_to_columns(P, h, p, b, m, F, i)
    else:
        simd.add_to_columns(P, h, p, b, m, F, i)


@kernel
def _apply_downdate(P, h, W, g, m, scale):
    if P.shape[2] % simd.LANES:
        loops.apply_downdate(P, h, W, g, m, scale)
    else:
        simd.apply_downdate(P, h, W, g, m, scale)


sum_rows = _sum_rows if USES_SIMD else loops.sum_rows
add_to_rows = _add_to_rows if USES_SIMD else loops.add_to_rows
add_to_columns = _add_to_columns if USES_SIMD else loops.add_to_columns
apply_downdate = _apply_downdate if USES_SIMD else loops.apply_downdate

__all__ = [
    "ROOM",
    "STATES",
    "USES_SIMD",
    "add_to_columns",
    "add_to_rows",
    "apply_downdate",
    "mirror",
    "sum_rows",
]
