"""The rotation of the whole group: corrections go round, and the covariance follows them.

No range measures the rotation of the group as a whole. At every estimate p the derivatives of the
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

from tracking.filters.joint.ekf.retraction import retract_rotation
from tracking.filters.joint.ekf.scalar_update import flush_updates
from tracking.kernels.jit import kernel, small_kernel
from tracking.maths.covariance import mirror, sum_rows

LINE = 1e-3
"""[-] Share of a group's extent that a line has across, so that it has a rotation about itself."""


@small_kernel
def enforce_observability(c, s, h, work):
    """Let the covariance of hypothesis h follow what measurements have moved.

    That must not be late while the rotation is uncertain: each range with a false derivative by it
    rotates the group, which makes the next derivative more false.
    """
    present, extent2, moved2 = 0, 0.0, 0.0
    for k in range(c.d):
        mean, shift, present = 0.0, 0.0, 0
        for i in range(s.nodes.shape[0]):
            if s.nodes[i].present:
                at = s.nodes[i].i_pos + k
                mean += s.x[h, at]
                shift += s.accumulated_correction[h, at]
                present += 1
        for i in range(s.nodes.shape[0]):
            if s.nodes[i].present:
                at = s.nodes[i].i_pos + k
                extent2 += (s.x[h, at] - mean / present) ** 2
                moved2 += (s.accumulated_correction[h, at] - shift / present) ** 2
    if present < 3:
        s.accumulated_correction[h, :] = 0.0
        return
    is_far = moved2 > c.follow_share**2 * extent2
    if is_far or moved2 * s.group[0].heading_gauge_var > c.follow_false**2 * s.group[0].white_var:
        flush_updates(s, h)
        shift_nullspace(c, s, h, min(1.0, c.follow_most * math.sqrt(extent2 / moved2)), work)


@small_kernel
def propagate_corrections(c, s, h):
    """What measurements moved velocities by moves positions on until the end of the sums."""
    for i in range(s.nodes.shape[0]):
        node = s.nodes[i]
        if node.present and not node.static:
            for k in range(c.d):
                s.accumulated_correction[h, node.i_pos + k] += (
                    s.preintegrated[i, 0] * s.accumulated_correction[h, node.i_vel + k]
                )


@kernel
def shift_nullspace(c, s, h, share, work):
    """Make rotations of what was moved, and ``P <- T P T^T`` for the given share of it.

    Hypothesis h has no pending updates.
    """
    n, end, axes = c.n, c.n_motion, 3 if c.d == 3 else 1
    A, B, G, P = work.turns[0], work.turns[1], work.turns[2], s.P
    centre, shift = find_centre(c, s, h)
    n_positions = rotation_tangents(c.d, s, h, centre, A, work.idx)
    rotation_functionals(c.d, A, work.idx, n_positions)
    if c.d == 3:
        retract_rotation(s, h, centre, A, work.idx, n_positions)
    correction_tangents(c.d, s, h, shift, share, end, G)
    for a in range(axes):
        for r in range(n_positions):
            work.val[r] = A[a, work.idx[r]]
        sum_rows(P, h, work.idx, work.val, n_positions, s.pending_updates, work.share, 0, B[a])
    add_half_square(c.d, A, B, G, work.idx, n_positions, end)
    for r in range(end):
        g, b = G[0, r], B[0, r]
        if axes == 1:
            for k in range(end):
                P[h, r, k] += g * B[0, k] + b * G[0, k]
            for k in range(end, n):
                P[h, r, k] += g * B[0, k]
        else:
            g1, b1, g2, b2 = G[1, r], B[1, r], G[2, r], B[2, r]
            for k in range(end):
                turn = (g * B[0, k] + b * G[0, k]) + (g1 * B[1, k] + b1 * G[1, k])
                P[h, r, k] += turn + (g2 * B[2, k] + b2 * G[2, k])
            for k in range(end, n):
                P[h, r, k] += g * B[0, k] + g1 * B[1, k] + g2 * B[2, k]
    mirror(P, h, end)
    s.accumulated_correction[h, :] = 0.0


@small_kernel
def find_centre(c, s, h):
    """The centre of the positions before the move, and the move of it, three numbers each [m]."""
    mean0, mean1, mean2, shift0, shift1, shift2, present = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0
    for i in range(s.nodes.shape[0]):
        if s.nodes[i].present:
            present += 1
            at = s.nodes[i].i_pos
            shift0, shift1 = (
                shift0 + s.accumulated_correction[h, at],
                shift1 + s.accumulated_correction[h, at + 1],
            )
            mean0, mean1 = mean0 + s.x[h, at], mean1 + s.x[h, at + 1]
            if c.d == 3:
                mean2, shift2 = mean2 + s.x[h, at + 2], shift2 + s.accumulated_correction[h, at + 2]
    share = 1.0 / max(present, 1)
    shift = (share * shift0, share * shift1, share * shift2)
    return (share * mean0 - shift[0], share * mean1 - shift[1], share * mean2 - shift[2]), shift


@small_kernel
def rotation_tangents(d, s, h, centre, N, idx):
    """Write the positions before the move, turned by a radian about each axis through the centre.

    Args:
        d: Dimensions.
        s: JointState of one environment.
        h: Hypothesis.
        centre: Before the move, three numbers [m].
        N: (axis, state), z first, written where there are positions.
        idx: Their states, written.

    Returns:
        How many there are.
    """
    m = 0
    for i in range(s.nodes.shape[0]):
        if s.nodes[i].present:
            at, z = s.nodes[i].i_pos, 0.0
            x = s.x[h, at] - s.accumulated_correction[h, at] - centre[0]
            y = s.x[h, at + 1] - s.accumulated_correction[h, at + 1] - centre[1]
            if d == 3:
                z = s.x[h, at + 2] - s.accumulated_correction[h, at + 2] - centre[2]
            write_tangents(d, N, at, x, y, z)
            for k in range(d):
                idx[m + k] = at + k
            m += d
    return m


@small_kernel
def correction_tangents(d, s, h, shift, share, end, G):
    """Write a share of the moves of positions and velocities, turned as well, (axis, state)."""
    for a in range(3):
        for r in range(end):
            G[a, r] = 0.0
    for i in range(s.nodes.shape[0]):
        node = s.nodes[i]
        if not node.present:
            continue
        at, z = node.i_pos, 0.0
        x, y = (
            share * (s.accumulated_correction[h, at] - shift[0]),
            share * (s.accumulated_correction[h, at + 1] - shift[1]),
        )
        if d == 3:
            z = share * (s.accumulated_correction[h, at + 2] - shift[2])
        write_tangents(d, G, at, x, y, z)
        if not node.static:
            at = node.i_vel
            x, y = (
                share * s.accumulated_correction[h, at],
                share * s.accumulated_correction[h, at + 1],
            )
            if d == 3:
                z = share * s.accumulated_correction[h, at + 2]
            write_tangents(d, G, at, x, y, z)


@small_kernel
def write_tangents(d, N, at, x, y, z):
    """Write a vector turned by a radian about z, and in space about y and x, to rows of N."""
    N[0, at], N[0, at + 1] = -y, x
    if d == 3:
        N[0, at + 2] = 0.0
        N[1, at], N[1, at + 1], N[1, at + 2] = z, 0.0, -x
        N[2, at], N[2, at + 1], N[2, at + 2] = 0.0, -z, y


@small_kernel
def rotation_functionals(d, N, idx, m):
    """Make ``(N N^T)^-1 N`` of N, which reads the rotation off an error, (axis, state).

    A few elements by hand: calling a library for them takes longer than all else here.
    """
    zz, yy, xx, zy, zx, yx = 1e-9, 1e-9, 1e-9, 0.0, 0.0, 0.0
    for r in range(m):
        at = idx[r]
        zz += N[0, at] * N[0, at]
        if d == 3:
            yy, xx = yy + N[1, at] * N[1, at], xx + N[2, at] * N[2, at]
            zy, zx = zy + N[0, at] * N[1, at], zx + N[0, at] * N[2, at]
            yx += N[1, at] * N[2, at]
    # A line has no rotation about itself.
    if d == 2:
        zz *= 1.0 + LINE
        for r in range(m):
            N[0, idx[r]] /= zz
        return
    least = LINE * (zz + yy + xx)
    zz, yy, xx = zz + least, yy + least, xx + least
    i00, i01, i02 = yy * xx - yx * yx, zx * yx - zy * xx, zy * yx - zx * yy
    i11, i12, i22 = zz * xx - zx * zx, zy * zx - zz * yx, zz * yy - zy * zy
    inverse = 1.0 / (zz * i00 + zy * i01 + zx * i02)
    for r in range(m):
        at = idx[r]
        n0, n1, n2 = inverse * N[0, at], inverse * N[1, at], inverse * N[2, at]
        N[0, at] = i00 * n0 + i01 * n1 + i02 * n2
        N[1, at] = i01 * n0 + i11 * n1 + i12 * n2
        N[2, at] = i02 * n0 + i12 * n1 + i22 * n2


@small_kernel
def add_half_square(d, A, B, G, idx, m, end):
    """``B += A B^T G / 2``, with which ``B^T G + G^T B`` is all that T adds to P."""
    s00, s01, s02, s10, s11, s12, s20, s21, s22 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for r in range(m):
        at = idx[r]
        half, b0 = 0.5 * A[0, at], B[0, at]
        s00 += half * b0
        if d == 3:
            b1, b2, half1, half2 = B[1, at], B[2, at], 0.5 * A[1, at], 0.5 * A[2, at]
            s01, s02 = s01 + half * b1, s02 + half * b2
            s10, s11, s12 = s10 + half1 * b0, s11 + half1 * b1, s12 + half1 * b2
            s20, s21, s22 = s20 + half2 * b0, s21 + half2 * b1, s22 + half2 * b2
    if d == 2:
        for k in range(end):
            B[0, k] += s00 * G[0, k]
        return
    for k in range(end):
        g0, g1, g2 = G[0, k], G[1, k], G[2, k]
        B[0, k] += s00 * g0 + s01 * g1 + s02 * g2
        B[1, k] += s10 * g0 + s11 * g1 + s12 * g2
        B[2, k] += s20 * g0 + s21 * g1 + s22 * g2
