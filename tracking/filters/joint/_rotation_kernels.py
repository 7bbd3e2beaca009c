"""The rotation of the whole group: corrections go round, and the covariance follows them.

No range tells how the group is turned as a whole. At every estimate p the derivatives of the
ranges are blind to one direction per axis, ``axis x p``. But the estimate moves from one range
to the next, and with it the blind direction: what was blind to the first range is not quite
blind to the second, and the filter comes to believe in a rotation that nothing has measured
[1, 2]. It is worst where errors are as large as the group, as on a body.

So the error is thought of as a rotation of the group and the rest: ``e = N a + r``, with N the
velocities and positions turned by one radian, and a the best rotation of the positions' errors.
When measurements move the estimate, N becomes N + G, a and r stay: ``P <- T P T^T`` with
``T = I + G A^T`` and A the functional that reads a from e. It is invariance under rotations,
kept by the filter of section 4 of [2], in the states that are used here anyway.

A correction is linear: it moves every node straight ahead along its tangent, which is a rotation
and a stretch of ``1 - cos``. Corrections back and forth stretch again and again, and what is known
of a shape (distances that were surveyed) does not undo it, since it is used up. So what is a
rotation in a move is made one, velocities with the positions; in space only: in the plane all
nodes range with each other, which takes back within the same move what a layout has grown by.

References:
    [1] Huang, Mourikis, Roumeliotis, Observability-based rules for designing consistent EKF
        SLAM estimators, Int. J. Robotics Research 29 (2010) 502.
    [2] Barrau, Bonnabel, An EKF-SLAM algorithm with consistency properties, arXiv:1510.06263.
"""

from __future__ import annotations

import math

import numpy as np

from tracking.compiled import allocating_kernel, small_kernel
from tracking.filters.joint._linear_kernels import settle
from tracking.filters.joint._peak_kernels import turned_by

ENOUGH = 0.01
"""[-] The covariance follows once the positions have moved by this share of the group's extent."""
FALSE = 0.05
"""[-] Or once a range would see an uncertain turn of the plane by this share of its noise."""
MOST = 0.3
"""[-] It follows a move by at most this share at once."""


@small_kernel
def follow_rotation(c, s, h):
    """Let the covariance of hypothesis h follow what measurements have moved.

    That must not be late while the rotation is uncertain: each range that tells of it what it
    cannot know turns the group, by which the next one tells more.
    """
    present, extent2, moved2 = 0, 0.0, 0.0
    for k in range(c.d):
        mean, shift, present = 0.0, 0.0, 0
        for i in range(s.nodes.shape[0]):
            if s.nodes[i].present:
                at = s.nodes[i].at_p + k
                mean += s.x[h, at]
                shift += s.moved[h, at]
                present += 1
        for i in range(s.nodes.shape[0]):
            if s.nodes[i].present:
                at = s.nodes[i].at_p + k
                extent2 += (s.x[h, at] - mean / present) ** 2
                moved2 += (s.moved[h, at] - shift / present) ** 2
    false2 = moved2 * s.group[0].turn_var
    if present < 3:
        s.moved[h, :] = 0.0
    elif moved2 > ENOUGH * ENOUGH * extent2 or false2 > FALSE * FALSE * c.white_var:
        settle(s, h)
        turn_covariance(c, s, h, min(1.0, MOST * math.sqrt(extent2 / moved2)))


@small_kernel
def carry_moves(c, s, h):
    """What measurements moved velocities by moves positions on until the end of the sums."""
    for i in range(s.nodes.shape[0]):
        node = s.nodes[i]
        if node.present and not node.static:
            for k in range(c.d):
                s.moved[h, node.at_p + k] += s.pre[i, 0] * s.moved[h, node.at_v + k]


@allocating_kernel
def turn_covariance(c, s, h, share):
    """Make rotations of what was moved, and ``P <- T P T^T`` for the given share of it."""
    n, axes = c.n, 3 if c.d == 3 else 1
    N, G, mean, shift = np.zeros((axes, n)), np.zeros((axes, n)), np.zeros(3), np.zeros(3)
    find_centre(c, s, h, mean, shift)
    turned_positions(s, h, mean, N)
    A = best_rotation(N)
    if c.d == 3:
        bend_move(s, h, mean, A)
    turned_moves(s, h, shift, G)
    B = np.zeros((axes, n))
    for r in range(n):
        for a in range(axes):
            if A[a, r] != 0.0:
                for k in range(n):
                    B[a, k] += A[a, r] * s.P[h, r, k]
    G *= share
    B += 0.5 * (A @ B.T.copy()) @ G
    P = s.P
    for r in range(n):
        g, b = G[0, r], B[0, r]
        if axes == 1:
            for k in range(n):
                P[h, r, k] += g * B[0, k] + b * G[0, k]
        else:
            g1, b1, g2, b2 = G[1, r], B[1, r], G[2, r], B[2, r]
            for k in range(n):
                turn = (g * B[0, k] + b * G[0, k]) + (g1 * B[1, k] + b1 * G[1, k])
                P[h, r, k] += turn + (g2 * B[2, k] + b2 * G[2, k])
    s.moved[h, :] = 0.0


@allocating_kernel
def best_rotation(N):
    """``(N N^T)^-1 N``, which reads the rotation off an error, (axis, state).

    A few elements by hand: calling a library for them takes longer than all else here.
    """
    axes, n = N.shape
    M, inverse = np.zeros((axes, axes)), np.zeros((axes, axes))
    trace = 0.0
    for a in range(axes):
        for b in range(axes):
            for r in range(n):
                M[a, b] += N[a, r] * N[b, r]
        trace += M[a, a]
    for a in range(axes):
        M[a, a] += 1e-3 * trace + 1e-9  # a line has no rotation about itself
    if axes == 1:
        inverse[0, 0] = 1.0 / M[0, 0]
    else:
        for a in range(3):
            u, v = (a + 1) % 3, (a + 2) % 3
            for b in range(3):
                f, g = (b + 1) % 3, (b + 2) % 3
                inverse[b, a] = M[u, f] * M[v, g] - M[u, g] * M[v, f]
        inverse /= M[0, 0] * inverse[0, 0] + M[0, 1] * inverse[1, 0] + M[0, 2] * inverse[2, 0]
    return inverse @ N


@small_kernel
def find_centre(c, s, h, mean, shift):
    """Write the centre of the positions before the move, and the move of it, three numbers each."""
    present = 0
    for i in range(s.nodes.shape[0]):
        if s.nodes[i].present:
            present += 1
            for k in range(c.d):
                at = s.nodes[i].at_p + k
                mean[k] += s.x[h, at] - s.moved[h, at]
                shift[k] += s.moved[h, at]
    for k in range(c.d):
        mean[k] /= max(present, 1)
        shift[k] /= max(present, 1)


@small_kernel
def turned_positions(s, h, mean, N):
    """Write the positions before the move, turned by a radian about each axis through the centre.

    N is (axis, state); z comes first.
    """
    for i in range(s.nodes.shape[0]):
        node = s.nodes[i]
        if not node.present:
            continue
        for a in range(N.shape[0]):
            u, v = (3 - a) % 3, (4 - a) % 3
            at_u, at_v = node.at_p + u, node.at_p + v
            N[a, at_u] = -(s.x[h, at_v] - s.moved[h, at_v] - mean[v])
            N[a, at_v] = s.x[h, at_u] - s.moved[h, at_u] - mean[u]


@small_kernel
def turned_moves(s, h, shift, G):
    """Write the moves of positions and velocities, turned likewise, (axis, state)."""
    for i in range(s.nodes.shape[0]):
        node = s.nodes[i]
        if not node.present:
            continue
        for a in range(G.shape[0]):
            u, v = (3 - a) % 3, (4 - a) % 3
            G[a, node.at_p + u] = -(s.moved[h, node.at_p + v] - shift[v])
            G[a, node.at_p + v] = s.moved[h, node.at_p + u] - shift[u]
            if not node.static:
                G[a, node.at_v + u] = -s.moved[h, node.at_v + v]
                G[a, node.at_v + v] = s.moved[h, node.at_v + u]


@allocating_kernel
def bend_move(s, h, mean, A):
    """Let what is a rotation of the group in a move go round the centre instead of straight ahead.

    Args:
        s: JointState of one environment, in space; `x` and `moved` are updated.
        h: Hypothesis.
        mean: The centre before the move.
        A: What reads the rotation off a move, (axis, state).
    """
    w = np.zeros(3)
    for a in range(A.shape[0]):
        w[2 - a] = np.sum(A[a] * s.moved[h])
    aside = turned_by(w)  # R - 1 - [w]
    for a in range(3):
        u, v = (a + 1) % 3, (a + 2) % 3
        aside[a, a] -= 1.0
        aside[u, v] += w[a]
        aside[v, u] -= w[a]
    arm = np.zeros(3)
    for i in range(s.nodes.shape[0]):
        node = s.nodes[i]
        for at, is_position in ((node.at_p, True), (node.at_v, False)):
            if not node.present or at < 0:
                continue
            for k in range(3):
                arm[k] = s.x[h, at + k] - s.moved[h, at + k] - (mean[k] if is_position else 0.0)
            for k in range(3):
                change = np.sum(aside[k] * arm)
                s.x[h, at + k] += change
                s.moved[h, at + k] += change
