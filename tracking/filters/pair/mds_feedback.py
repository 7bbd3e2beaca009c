"""Weighted MDS of one group, aligned to the filters of its pairs in the same step.

Positions and velocities y_i of the nodes minimise the stress

    sum over pairs (y_j - y_i - x_ij)^T W_ij (y_j - y_i - x_ij),   W_ij = P_ij^-1

with the state x_ij and covariance P_ij of the pair's filter. Along the line of sight this is
the stress of weighted multidimensional scaling, ``w_ij (|p_j - p_i| - d_ij)^2`` to first order
[1], weighted by the certainty of the filter's range; an NLOS pair is uncertain along its line
and follows the others. Across the line it is an alignment to the filters' own vectors, as by
Procrustes, weighted by their certainty: so a layout as flat as a line needs no exception. The
stress is quadratic; its normal equations are solved by a Cholesky factor.

References:
    [1] De Leeuw, Heiser, Multidimensional scaling with restrictions on the configuration, in
        Multivariate Analysis V, 1980: weighted stress.
"""

from __future__ import annotations

import math

from tracking.kernels.jit import small_kernel

LEAST_VAR = 1e-6
"""[m2], [m2/s2] Added to every variance, since surveyed pairs of static nodes are nearly exact."""


@small_kernel
def at(k, d):
    """Return the index of the k-th of 2 d coordinates in the state of a pair."""
    return k if k < d else 3 + k - d


@small_kernel
def invert(L, W, m):
    """Invert a symmetric positive definite matrix.

    Args:
        L: Matrix, its first m rows and columns; the Cholesky factor is written to its lower half.
        W: Inverse, written to the first m rows and columns.
        m: Size.
    """
    factor(L, m)
    for k in range(m):
        # Column k of the inverse of L, then of L^-T L^-1.
        for r in range(m):
            s = 1.0 if r == k else 0.0
            for q in range(k, r):
                s -= L[r, q] * W[q, k]
            W[r, k] = s / L[r, r] if r >= k else 0.0
    for k in range(m):
        for r in range(m - 1, k - 1, -1):
            s = W[r, k]
            for q in range(r + 1, m):
                s -= L[q, r] * W[q, k]
            W[r, k] = s / L[r, r]
    for k in range(m):
        for r in range(k):
            W[r, k] = W[k, r]


@small_kernel
def factor(L, m):
    """Write the Cholesky factor of a symmetric positive definite matrix to its lower triangle."""
    for k in range(m):
        for r in range(k, m):
            s = L[r, k]
            for q in range(k):
                s -= L[r, q] * L[k, q]
            if r == k:
                L[k, k] = math.sqrt(max(s, 1e-12))
            else:
                L[r, k] = s / L[k, k]


@small_kernel
def solve(L, b, m):
    """Solve ``L L^T y = b`` in place."""
    for r in range(m):
        s = b[r]
        for q in range(r):
            s -= L[r, q] * b[q]
        b[r] = s / L[r, r]
    for r in range(m - 1, -1, -1):
        s = b[r]
        for q in range(r + 1, m):
            s -= L[q, r] * b[q]
        b[r] = s / L[r, r]


@small_kernel
def weigh(P, p, h, d, L, W):
    """Write the weight of pair p in hypothesis h, the inverse of its covariance, to W[p]."""
    m = 2 * d
    for r in range(m):
        for k in range(m):
            L[r, k] = P[p, h, at(r, d), at(k, d)]
        L[r, r] += LEAST_VAR
    invert(L, W[p], m)


@small_kernel
def add_pair(x, p, h, d, W, a, b, A, y):
    """Add pair p between members a < b to the normal equations; member 0 is the origin."""
    m = 2 * d
    for r in range(m):
        pull = 0.0
        for k in range(m):
            w = W[p, r, k]
            pull += w * x[p, h, at(k, d)]
            A[(b - 1) * m + r, (b - 1) * m + k] += w
            if a > 0:
                A[(a - 1) * m + r, (a - 1) * m + k] += w
                A[(b - 1) * m + r, (a - 1) * m + k] -= w
        y[(b - 1) * m + r] += pull
        if a > 0:
            y[(a - 1) * m + r] -= pull


@small_kernel
def move_pair(x, P, p, h, d, W, a, b, y, nu):
    """Set position and velocity of pair p to the MDS solution; its range error follows.

    The range error changes by its regression on that change, ``P_ey P_yy^-1 nu``. The covariance
    stays: the solution adds little information to the filters of the group.
    """
    m = 2 * d
    for r in range(m):
        value = y[(b - 1) * m + r]
        if a > 0:
            value -= y[(a - 1) * m + r]
        nu[r] = value - x[p, h, at(r, d)]
        x[p, h, at(r, d)] = value
    for e in range(6, x.shape[2]):
        for r in range(m):
            s = 0.0
            for k in range(m):
                s += W[p, r, k] * nu[k]
            x[p, h, e] += P[p, h, e, at(r, d)] * s
