"""Covariance operations that take most of the time, in plain loops (`covariance`)."""

from __future__ import annotations

from tracking.kernels.jit import kernel, small_kernel

STATES, ROOM = 7, 8
"""Largest number of states after position and velocity; length of a row of F."""


@kernel
def sum_rows(P, h, idx, val, m, W, share, q, w):
    """Write ``sum_k val_k P[h, idx_k] - sum_k share_k W[h, k]``, of m and q rows, to w."""
    w[:] = 0.0
    for k in range(0, m - m % 4, 4):
        v0, v1, v2, v3 = val[k], val[k + 1], val[k + 2], val[k + 3]
        p0, p1, p2, p3 = P[h, idx[k]], P[h, idx[k + 1]], P[h, idx[k + 2]], P[h, idx[k + 3]]
        for r in range(len(w)):
            w[r] += v0 * p0[r] + v1 * p1[r] + v2 * p2[r] + v3 * p3[r]
    for k in range(m - m % 4, m):
        add_row(w, val[k], P[h, idx[k]])
    take_off(w, share, W[h], q)


@small_kernel
def add_row(total, weight, row):
    """Add a row times a weight to the total."""
    for r in range(len(total)):
        total[r] += weight * row[r]


@small_kernel
def take_off(total, weights, rows, m):
    """Subtract the first m rows times their weights, four per sweep to save memory accesses."""
    for k in range(0, m - m % 4, 4):
        v0, v1, v2, v3 = weights[k], weights[k + 1], weights[k + 2], weights[k + 3]
        w0, w1, w2, w3 = rows[k], rows[k + 1], rows[k + 2], rows[k + 3]
        for r in range(len(total)):
            total[r] -= v0 * w0[r] + v1 * w1[r] + v2 * w2[r] + v3 * w3[r]
    for k in range(m - m % 4, m):
        add_row(total, -weights[k], rows[k])


@kernel
def add_to_rows(P, h, p, b, m, F, i):
    """Write ``F P``: change the rows of position and velocity of node i."""
    d = 2 if m == 3 else 3
    for r in range(2 * d):
        if r < d:
            add_row(P[h, p + r], F[i, STATES, r], P[h, p + d + r])
        for q in range(m):
            if F[i, q, r] != 0.0:
                add_row(P[h, p + r], F[i, q, r], P[h, b + q])


@kernel
def add_to_columns(P, h, p, b, m, F, i):
    """Write ``P F^T``: change the columns of node i, down to the last row of its velocity."""
    d = 2 if m == 3 else 3
    for k in range(p + 2 * d):
        row = P[h, k]
        for r in range(2 * d):
            if r < d:
                row[p + r] += F[i, STATES, r] * row[p + d + r]
            for q in range(m):
                row[p + r] += F[i, q, r] * row[b + q]


@kernel
def apply_downdate(P, h, W, g, m, scale):
    """Subtract W[g]^T W[g] of m rows from P[h]; scale rows and columns unless `scale` is None."""
    for r in range(P.shape[2]):
        row = P[h, r]
        take_off(row, W[g, :, r], W[g], m)
        if scale is not None:
            for k in range(len(row)):
                row[k] *= scale[r] * scale[k]


@kernel
def mirror(P, h, rows, first=0):
    """Copy the upper triangle of ``P[h, first:rows]`` to the lower triangle."""
    for r in range(first, rows):
        for k in range(r + 1, P.shape[2]):
            P[h, k, r] = P[h, r, k]


@kernel
def subtract_square(P, h, w):
    """Subtract ``w w^T`` from P[h]."""
    for r in range(P.shape[2]):
        add_row(P[h, r], -w[r], w)
