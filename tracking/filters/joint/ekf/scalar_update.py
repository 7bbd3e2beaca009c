"""Linear algebra of the joint filter: scalar measurements with few non-zero derivatives.

A measurement is a list of states and derivatives, so that its cost is that of one sweep over the
covariance. With the optimal gain ``K = PH / S`` the Joseph form reduces to ``P - (PH)(PH)^T / S``;
written with ``w = PH / sqrt(S)`` it is symmetric to the last bit.

The covariance of many states does not fit the nearest cache, and a sweep over it costs more than
the sums. So in larger groups updates are pending: the covariance is ``P - W^T W`` with one row of W
each, and one sweep applies them all before P is used for anything else (`flush_updates`).
"""

from __future__ import annotations

import math

from tracking.kernels.jit import small_kernel
from tracking.maths.covariance import apply_downdate, subtract_square, sum_rows


@small_kernel
def compute_pht(s, h, m, work):
    """Write ``w = P H`` of hypothesis h to the workspace; return ``H P H^T``.

    Args:
        s: JointState of one environment.
        h: Hypothesis.
        m: Number of non-zero derivatives.
        work: Workspace; `idx` and `val` hold their states and values.
    """
    idx, val, w, share, W = work.idx, work.val, work.w, work.share, s.pending_updates
    # Eight rows at a time, since one takes as long as eight; rows beyond the last are not used.
    for q in range(0, s.n_pending[h], 8):
        v0, v1, v2, v3, v4, v5, v6, v7 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for k in range(m):
            v, at = val[k], idx[k]
            v0, v1 = v0 + v * W[h, q, at], v1 + v * W[h, q + 1, at]
            v2, v3 = v2 + v * W[h, q + 2, at], v3 + v * W[h, q + 3, at]
            v4, v5 = v4 + v * W[h, q + 4, at], v5 + v * W[h, q + 5, at]
            v6, v7 = v6 + v * W[h, q + 6, at], v7 + v * W[h, q + 7, at]
        share[q], share[q + 1], share[q + 2], share[q + 3] = v0, v1, v2, v3
        share[q + 4], share[q + 5], share[q + 6], share[q + 7] = v4, v5, v6, v7
    sum_rows(s.P, h, idx, val, m, W, share, s.n_pending[h], w)
    variance = 0.0
    for k in range(m):
        variance += val[k] * w[idx[k]]
    return max(variance, 0.0)


@small_kernel
def covariance(s, h, a, b):
    """Return one element of the covariance of hypothesis h, pending updates included."""
    total = s.P[h, a, b]
    for q in range(s.n_pending[h]):
        total -= s.pending_updates[h, q, a] * s.pending_updates[h, q, b]
    return total


@small_kernel
def relative_covariance(P, h, i, j, a, b):
    """Return the covariance of axes a, b of a relative position, pending updates left out [m2]."""
    return P[h, i + a, i + b] + P[h, j + a, j + b] - P[h, i + a, j + b] - P[h, j + a, i + b]


@small_kernel
def relative_variance_bound(s, h, i, j, d):
    """Return a bound of the trace of a relative position's covariance, which updates lower [m2].

    Args:
        s: JointState of one environment.
        h: Hypothesis.
        i: First state of one position.
        j: First state of the other position.
        d: 2 or 3.
    """
    trace = relative_covariance(s.P, h, i, j, 0, 0) + relative_covariance(s.P, h, i, j, 1, 1)
    return trace + relative_covariance(s.P, h, i, j, 2, 2) if d == 3 else trace


@small_kernel
def relative_variance_across(s, h, i, j, u0, u1, u2, d):
    """Return the trace of a relative position's covariance across u, with pending updates [m2]."""
    P, W = s.P, s.pending_updates
    trace = relative_variance_bound(s, h, i, j, d)
    along = u0 * u0 * relative_covariance(P, h, i, j, 0, 0)
    along += u1 * u1 * relative_covariance(P, h, i, j, 1, 1)
    along += 2.0 * u0 * u1 * relative_covariance(P, h, i, j, 0, 1)
    if d == 3:
        across = u0 * relative_covariance(P, h, i, j, 0, 2)
        across += u1 * relative_covariance(P, h, i, j, 1, 2)
        along += u2 * (2.0 * across + u2 * relative_covariance(P, h, i, j, 2, 2))
    # One sum per axis: additions do not depend on each other.
    t0, t1, t2 = 0.0, 0.0, 0.0
    for q in range(s.n_pending[h]):
        off0, off1, off2 = W[h, q, j] - W[h, q, i], W[h, q, j + 1] - W[h, q, i + 1], 0.0
        if d == 3:
            off2 = W[h, q, j + 2] - W[h, q, i + 2]
        t0, t1, t2 = t0 + off0 * off0, t1 + off1 * off1, t2 + off2 * off2
        part = u0 * off0 + u1 * off1 + u2 * off2
        along -= part * part
    return trace - (t0 + t1 + t2) - along


@small_kernel
def kalman_update(s, h, w, nu, S):
    """Correct hypothesis h with an innovation nu of variance S; w is ``P H``, overwritten.

    The correction of the states is added to `accumulated_correction`.
    """
    x, P, W, moved = s.x, s.P, s.pending_updates, s.accumulated_correction
    n, room = P.shape[2], W.shape[1]
    gain, scale = nu / S, 1.0 / math.sqrt(S)
    if room > 0:
        if s.n_pending[h] == room:
            flush_updates(s, h)
        q = s.n_pending[h]
        for r in range(n):
            w_r = w[r]
            x[h, r] += w_r * gain
            moved[h, r] += w_r * gain
            W[h, q, r] = w_r * scale
        s.n_pending[h] = q + 1
        return
    for r in range(n):
        x[h, r] += w[r] * gain
        moved[h, r] += w[r] * gain
        w[r] *= scale
    subtract_square(P, h, w)


@small_kernel
def flush_updates(s, h):
    """Apply the pending updates of hypothesis h: afterwards P is its covariance.

    Functions that use P beyond those of this module call it first. `rare` and `supervise` find no
    pending updates.
    """
    if s.n_pending[h] > 0:
        apply_downdate(s.P, h, s.pending_updates, h, s.n_pending[h], None)
        s.n_pending[h] = 0


@small_kernel
def reset_state(s, h, n, at, variance):
    """Reset one state: value 0, the given variance, no correlation."""
    for r in range(n):
        s.P[h, at, r] = 0.0
        s.P[h, r, at] = 0.0
    s.P[h, at, at] = variance
    s.x[h, at] = 0.0
    for k in range(s.sensitivity.shape[1]):
        s.sensitivity[h, k, at] = 0.0


@small_kernel
def scale_state(s, h, n, at, share):
    """Scale the covariances and sensitivities of one state; its value stays."""
    for r in range(n):
        s.P[h, at, r] *= share
        s.P[h, r, at] *= share
    for q in range(s.n_pending[h]):
        s.pending_updates[h, q, at] *= share
    for k in range(s.sensitivity.shape[1]):
        s.sensitivity[h, k, at] *= share


@small_kernel
def symmetrise(P, h, n):
    """Average P with its transpose, to remove rounding differences."""
    for r in range(n):
        for c in range(r + 1, n):
            mean = 0.5 * (P[h, r, c] + P[h, c, r])
            P[h, r, c] = mean
            P[h, c, r] = mean
