"""The linear algebra of the joint filter: scalar measurements with few non-zero derivatives.

A measurement is a list of states and derivatives, so that its cost is that of one sweep over
the covariance. With the optimal gain ``K = PH / S`` the Joseph form reduces to
``P - (PH)(PH)^T / S``; written with ``w = PH / sqrt(S)`` it is symmetric to the last bit.

A covariance of many states does not fit the nearest cache, and a sweep over it costs more than
the sums. So in larger groups corrections wait: the covariance is ``P - W^T W`` with one row of W
each, and one sweep takes them all off before P is used for anything else (`settle`).
"""

from __future__ import annotations

import math

from tracking.compiled import small_kernel
from tracking.filters.joint._product_kernels import take_off


@small_kernel
def project(s, h, n, m, idx, val, w):
    """Write ``w = P H`` of hypothesis h; returns ``H P H^T``.

    Args:
        s: JointState of one environment.
        h: Hypothesis.
        n: Number of states.
        m: Number of non-zero derivatives.
        idx: Their states.
        val: The derivatives.
        w: Written, (state).
    """
    P, W = s.P, s.waiting
    sum_rows(P, h, n, m, idx, val, w)
    n_waiting = s.n_waiting[h]
    for q in range(0, n_waiting - n_waiting % 4, 4):
        v0, v1, v2, v3 = 0.0, 0.0, 0.0, 0.0
        for k in range(m):
            v, at = val[k], idx[k]
            v0, v1 = v0 + v * W[h, q, at], v1 + v * W[h, q + 1, at]
            v2, v3 = v2 + v * W[h, q + 2, at], v3 + v * W[h, q + 3, at]
        for r in range(n):
            first = v0 * W[h, q, r] + v1 * W[h, q + 1, r]
            w[r] -= first + (v2 * W[h, q + 2, r] + v3 * W[h, q + 3, r])
    for q in range(n_waiting - n_waiting % 4, n_waiting):
        v = 0.0
        for k in range(m):
            v += val[k] * W[h, q, idx[k]]
        for r in range(n):
            w[r] -= v * W[h, q, r]
    variance = 0.0
    for k in range(m):
        variance += val[k] * w[idx[k]]
    return max(variance, 0.0)


@small_kernel
def sum_rows(P, h, n, m, idx, val, w):
    """Write ``w = P[h] H``, several rows at a time: each number of w is stored less often."""
    k = 1
    if m >= 4:
        i0, i1, i2, i3 = idx[0], idx[1], idx[2], idx[3]
        v0, v1, v2, v3 = val[0], val[1], val[2], val[3]
        for r in range(n):
            w[r] = (v0 * P[h, i0, r] + v1 * P[h, i1, r]) + (v2 * P[h, i2, r] + v3 * P[h, i3, r])
        k = 4
    else:
        i0, v0 = idx[0], val[0]
        for r in range(n):
            w[r] = v0 * P[h, i0, r]
    while k + 1 < m:
        i0, i1, v0, v1 = idx[k], idx[k + 1], val[k], val[k + 1]
        for r in range(n):
            w[r] += v0 * P[h, i0, r] + v1 * P[h, i1, r]
        k += 2
    if k < m:
        i0, v0 = idx[k], val[k]
        for r in range(n):
            w[r] += v0 * P[h, i0, r]


@small_kernel
def covariance(s, h, a, b):
    """One element of the covariance of hypothesis h, what waits included."""
    total = s.P[h, a, b]
    for q in range(s.n_waiting[h]):
        total -= s.waiting[h, q, a] * s.waiting[h, q, b]
    return total


@small_kernel
def absorb(s, h, n, w, nu, S):
    """Correct hypothesis h with an innovation nu of variance S; w is ``P H``, overwritten.

    What the states are moved by is added to `moved`.
    """
    x, P, W, moved = s.x, s.P, s.waiting, s.moved
    gain = nu / S
    for r in range(n):
        x[h, r] += w[r] * gain
        moved[h, r] += w[r] * gain
    scale = 1.0 / math.sqrt(S)
    for r in range(n):
        w[r] *= scale
    room = W.shape[1]
    if room == 0:
        for r in range(n):
            w_r = w[r]
            for c in range(n):
                P[h, r, c] -= w_r * w[c]
        return
    if s.n_waiting[h] == room:
        settle(s, h)
    q = s.n_waiting[h]
    for r in range(n):
        W[h, q, r] = w[r]
    s.n_waiting[h] = q + 1


@small_kernel
def settle(s, h):
    """Take off what waits: from here on P is the covariance of hypothesis h."""
    if s.n_waiting[h] > 0:
        take_off(s.P, h, s.waiting, h, s.n_waiting[h])
        s.n_waiting[h] = 0


@small_kernel
def settle_all(s):
    """Take off what waits in every hypothesis."""
    for h in range(s.alive.shape[0]):
        if s.alive[h]:
            settle(s, h)


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
