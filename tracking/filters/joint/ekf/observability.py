"""Observability constraint: the null space of the covariance follows the corrections.

No range measures the rotation of the group as a whole. At every estimate p the derivatives of the
ranges have one null direction per axis, ``axis x p``. But the estimate moves from one range to the
next, and with it the null direction: that of the first range is not quite that of the second, and
the variance of the rotation falls although nothing has measured it [1, 2]. The effect is largest
where errors are as large as the group, as on a body.

So the error is split into a rotation of the group and the rest: ``e = N a + r``, with N the
velocities and positions rotated by one radian, and a the best rotation of the positions' errors.
When measurements move the estimate, N becomes N + G, a and r stay: ``P <- T P T^T`` with
``T = I + G A^T`` and A the functional that reads a from e. This is the invariance under rotations
of the filter of section 4 of [2], in the states that are used here anyway.

A correction is linear: it moves every node along its tangent, which is a rotation and a stretch of
``1 - cos``. Stretches add up, and information about the shape that is used up (surveyed distances)
does not undo them. So the rotation in a move is made a finite one, velocities with the positions;
in space only: in the plane all nodes range with each other, which undoes them within the same move.

References:
    [1] Huang, Mourikis, Roumeliotis, Observability-based rules for designing consistent EKF
        SLAM estimators, Int. J. Robotics Research 29 (2010) 502.
    [2] Barrau, Bonnabel, An EKF-SLAM algorithm with consistency properties, arXiv:1510.06263.
"""

from __future__ import annotations

import numpy as np

from tracking.filters.joint.ekf.columns import DT
from tracking.filters.joint.ekf.scalar_update import flush_updates
from tracking.kernels.jit import allocating_kernel, kernel, small_kernel
from tracking.maths.covariance import mirror, sum_rows
from tracking.maths.rotation_modes import rotation_exp

LINE = 1e-3
"""[-] Share of the inertia of a group that is added about every axis, for layouts in a line."""


@kernel
def enforce_observability(c, s, h, work):
    """Shift the null space of hypothesis h once corrections or their false information are large.

    A late shift is harmful while the rotation is uncertain: each range with a false derivative by
    it rotates the group, which makes the next derivative more false.
    """
    moved, present, extent2, moved2 = s.accumulated_correction[h], 0, 0.0, 0.0
    for k in range(c.d):
        mean, shift, present = 0.0, 0.0, 0
        for node in s.nodes:
            if node.present:
                mean += s.x[h, node.i_pos + k]
                shift += moved[node.i_pos + k]
                present += 1
        for node in s.nodes:
            if node.present:
                extent2 += (s.x[h, node.i_pos + k] - mean / present) ** 2
                moved2 += (moved[node.i_pos + k] - shift / present) ** 2
    false2 = moved2 * s.group[0].heading_gauge_var / s.group[0].white_var
    if present < 3:
        moved[:] = 0.0
    elif moved2 > c.follow_share**2 * extent2 or false2 > c.follow_false**2:
        shift_nullspace(c, s, h, min(1.0, c.follow_most * np.sqrt(extent2 / moved2)), work)


@small_kernel
def propagate_corrections(c, s, h):
    """Add corrections of velocities, times the preintegrated time, to those of positions."""
    moved = s.accumulated_correction[h]
    for i in range(s.nodes.shape[0]):
        node = s.nodes[i]
        if node.present and not node.static:
            for k in range(c.d):
                moved[node.i_pos + k] += s.preintegrated[i, DT] * moved[node.i_vel + k]


@allocating_kernel
def shift_nullspace(c, s, h, share, work):
    """Make the corrections rotations, and set ``P <- T P T^T`` for the given share of them."""
    flush_updates(s, h)
    d, n_axes, x, moved = c.d, 3 if c.d == 3 else 1, s.x[h], s.accumulated_correction[h]
    A, B, G = work.turns[0, :n_axes], work.turns[1, :n_axes], work.turns[2, :n_axes]
    P, end, m = s.P, c.n_motion, 0
    centre, shift, still, v = np.zeros(d), np.zeros(d), np.zeros(d), np.zeros(d)
    for node in s.nodes:
        if node.present:
            for k in range(d):
                work.idx[m] = node.i_pos + k
                centre[k] += x[node.i_pos + k] - moved[node.i_pos + k]
                shift[k] += moved[node.i_pos + k]
                m += 1
    for k in range(d):
        centre[k], shift[k] = d * centre[k] / m, d * shift[k] / m  # before the move; its mean
    for node in s.nodes:
        if node.present:
            for k in range(d):
                v[k] = x[node.i_pos + k] - moved[node.i_pos + k] - centre[k]
            write_tangents(A, node.i_pos, v)
    w = make_functionals(A, work.idx[:m], moved)
    if d == 3:
        tangent, bend = np.zeros((3, 3)), rotation_exp(w) - np.eye(3)
        write_tangents(tangent, 0, w)  # cross product matrix of w
        bend -= tangent
        for node in s.nodes:
            if node.present:
                retract(x, moved, node.i_pos, centre, bend, v)
            if node.present and not node.static:
                retract(x, moved, node.i_vel, still, bend, v)
    G[:, :end] = 0.0
    for node in s.nodes:
        if node.present:
            for k in range(d):
                v[k] = share * (moved[node.i_pos + k] - shift[k])
            write_tangents(G, node.i_pos, v)
        if node.present and not node.static:
            for k in range(d):
                v[k] = share * moved[node.i_vel + k]
            write_tangents(G, node.i_vel, v)
    for a in range(n_axes):
        for r in range(m):
            work.val[r] = A[a, work.idx[r]]
        sum_rows(P, h, work.idx, work.val, m, s.pending_updates, work.share, 0, B[a])
    # With half of A B^T G added to B, T adds B^T G + G^T B to P.
    half = np.zeros((n_axes, n_axes))
    for r in work.idx[:m]:
        for a in range(n_axes):
            for b in range(n_axes):
                half[a, b] += 0.5 * A[a, r] * B[b, r]
    for a in range(n_axes):
        for b in range(n_axes):
            for k in range(end):
                B[a, k] += half[a, b] * G[b, k]
    for r in range(end):
        for a in range(n_axes):
            g, b = G[a, r], B[a, r]
            for k in range(end):
                P[h, r, k] += g * B[a, k] + b * G[a, k]
            for k in range(end, c.n):
                P[h, r, k] += g * B[a, k]
    mirror(P, h, end)
    moved[:] = 0.0


@small_kernel
def write_tangents(N, at, v):
    """Write the derivatives of a vector by a rotation about each axis to N, (axis, state)."""
    if len(v) == 2:
        N[0, at], N[0, at + 1] = -v[1], v[0]
        return
    N[0, at], N[0, at + 1], N[0, at + 2] = 0.0, -v[2], v[1]
    N[1, at], N[1, at + 1], N[1, at + 2] = v[2], 0.0, -v[0]
    N[2, at], N[2, at + 1], N[2, at + 2] = -v[1], v[0], 0.0


@allocating_kernel
def make_functionals(N, idx, moved):
    """Replace N by ``(N N^T)^-1 N``, which gives the rotation in an error; return a move's."""
    n = len(N)
    inertia, w, column = np.zeros((n, n)), np.zeros(n), np.zeros(n)
    for r in idx:
        for a in range(n):
            for b in range(n):
                inertia[a, b] += N[a, r] * N[b, r]
    least = LINE * np.trace(inertia) + 1e-9  # a line has no rotation about itself
    for a in range(n):
        inertia[a, a] += least
    inverse = np.linalg.inv(inertia)
    for r in idx:
        column[:] = N[:, r]
        for a in range(n):
            N[a, r] = 0.0
            for b in range(n):
                N[a, r] += inverse[a, b] * column[b]
            w[a] += N[a, r] * moved[r]
    return w


@small_kernel
def retract(x, moved, at, centre, bend, v):
    """Add to a move about a centre the difference between a rotation and its tangent."""
    for k in range(3):
        v[k] = x[at + k] - moved[at + k] - centre[k]
    for k in range(3):
        change = bend[k, 0] * v[0] + bend[k, 1] * v[1] + bend[k, 2] * v[2]
        x[at + k] += change
        moved[at + k] += change
