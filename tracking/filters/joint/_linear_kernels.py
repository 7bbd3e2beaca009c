"""The linear algebra of the joint filter: scalar measurements with few non-zero derivatives.

A measurement is a list of states and derivatives, so that its cost is that of one sweep over
the covariance. With the optimal gain ``K = PH / S`` the Joseph form reduces to
``P - (PH)(PH)^T / S``; written with ``w = PH / sqrt(S)`` it is symmetric to the last bit.
"""

from __future__ import annotations

import math

from tracking.compiled import small_kernel


@small_kernel
def project(P, h, n, m, idx, val, w):
    """Write ``w = P H`` of hypothesis h; returns ``H P H^T``.

    Args:
        P: Covariances, (hyp, state, state).
        h: Hypothesis.
        n: Number of states.
        m: Number of non-zero derivatives.
        idx: Their states.
        val: The derivatives.
        w: Written, (state).
    """
    first, v = idx[0], val[0]
    for r in range(n):
        w[r] = v * P[h, first, r]
    for k in range(1, m):
        row, v = idx[k], val[k]
        for r in range(n):
            w[r] += v * P[h, row, r]
    variance = 0.0
    for k in range(m):
        variance += val[k] * w[idx[k]]
    return max(variance, 0.0)


@small_kernel
def absorb(x, P, moved, h, n, w, nu, S):
    """Correct hypothesis h with an innovation nu of variance S; w is ``P H``, overwritten.

    What the states are moved by is added to `moved`, (hyp, state).
    """
    gain = nu / S
    for r in range(n):
        x[h, r] += w[r] * gain
        moved[h, r] += w[r] * gain
    scale = 1.0 / math.sqrt(S)
    for r in range(n):
        w[r] *= scale
    for r in range(n):
        w_r = w[r]
        for c in range(n):
            P[h, r, c] -= w_r * w[c]


@small_kernel
def decouple(x, P, h, n, at, variance):
    """Forget what is known about one state: value 0, the given variance, no correlation."""
    for r in range(n):
        P[h, at, r] = 0.0
        P[h, r, at] = 0.0
    P[h, at, at] = variance
    x[h, at] = 0.0


@small_kernel
def symmetrise(P, h, n):
    """Take out what rounding has made unequal across the diagonal."""
    for r in range(n):
        for c in range(r + 1, n):
            mean = 0.5 * (P[h, r, c] + P[h, c, r])
            P[h, r, c] = mean
            P[h, c, r] = mean
