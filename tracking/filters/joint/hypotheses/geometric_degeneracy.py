"""Degeneracy of a layout: its extent across the line or plane nearest to it."""

from __future__ import annotations

import numpy as np

from tracking.kernels.jit import allocating_kernel


@allocating_kernel
def degeneracy_ratio(c, s, h, turns):
    """Return the least extent of the layout over its standard deviation; infinite for few nodes.

    Args:
        c: Coefficients.
        s: JointState of one environment.
        h: Hypothesis without pending updates.
        turns: True if errors that rotate the whole group count. In space they may be large, and
            they make the layout no flatter.
    """
    d = c.d
    X, members = centred_positions(c, s, h)
    m = len(members)
    if m <= d or not np.all(np.isfinite(X)):
        return np.inf
    squared, E = np.linalg.eigh(X.T.copy() @ X)
    # A common error across the layout does not change its extent; nor does an error that grows
    # linearly along the layout, a rotation.
    own = np.eye(m) - 1.0 / m
    if d == 3 and not turns and squared[1] * squared[2] > 1e-9 * (squared[1] + squared[2]) ** 2:
        for k in range(1, 3):
            along = X @ E[:, k].copy()
            own -= np.outer(along, along) / squared[k]
    variance = 0.0
    for a in range(m):
        for b in range(m):
            p, q = s.nodes[members[a]].i_pos, s.nodes[members[b]].i_pos
            for r in range(d):
                for k in range(d):
                    variance += own[a, b] * E[r, 0] * E[k, 0] * s.P[h, p + r, q + k]
    return np.sqrt(max(squared[0], 0.0) / max(variance, 1e-12))


@allocating_kernel
def least_axis(c, s, h):
    """Return the direction across the line or plane nearest to the layout, (d)."""
    X, _ = centred_positions(c, s, h)
    _, E = np.linalg.eigh(X.T.copy() @ X)
    return E[:, 0].copy()


@allocating_kernel
def centred_positions(c, s, h):
    """Return positions of the present nodes about their mean, (m, d), and these nodes, (m)."""
    n, m = s.nodes.shape[0], 0
    X, members = np.empty((n, c.d)), np.empty(n, np.int64)
    for i in range(n):
        if s.nodes[i].present:
            at, members[m] = s.nodes[i].i_pos, i
            X[m] = s.x[h, at : at + c.d]
            m += 1
    for k in range(c.d):
        X[:m, k] -= np.mean(X[:m, k])
    return X[:m], members[:m]
