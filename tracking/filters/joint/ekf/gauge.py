"""Gauge of a group: its position and its rotation, which no range observes.

Position: ranges and accelerations do not observe the position of the group as a whole. Its centre
is moved back to the origin once a period, with a fixed variance that is independent of all else;
differences between nodes are not affected.

Rotation: until a group has driven, it is known no better than the gap between the rotations tried.
Ranges between nodes at rest do not measure it, nor does a node that joins. Derivatives that are
slightly out of date lower its variance all the same, and it is degrees off when the group begins to
move. So its variance is monitored, and restored where it is too small. In space one filter
represents all rotations until they are known (`alignment_sensitivity`).
"""

from __future__ import annotations

import numpy as np

from tracking.filters.joint.ekf.observability import write_tangents
from tracking.filters.joint.ekf.scalar_update import flush_updates, symmetrise
from tracking.kernels.jit import allocating_kernel, kernel


@allocating_kernel
def group_centre(c, s, h):
    """Return mean position [m] and velocity [m/s] of the present nodes in hypothesis h, (d) each.

    The velocity is 0 with static nodes, which fix it.
    """
    pos, vel, present, moving = np.zeros(c.d), np.zeros(c.d), 0, 0
    for node in s.nodes:
        if node.present:
            present += 1
            pos += s.x[h, node.i_pos : node.i_pos + c.d]
            if not node.static:
                moving += 1
                vel += s.x[h, node.i_vel : node.i_vel + c.d]
    if moving < present:
        vel[:] = 0.0
    return pos / max(present, 1), vel / max(moving, 1)


@kernel
def centre(c, s, h, w):
    """Move the centre of the group to the origin: ``p <- p - mean p``, and P with it.

    The covariance becomes ``T P T^T`` with the projection T, plus a common variance, so that
    it stays positive definite and bounded.
    """
    n_nodes = s.nodes.shape[0]
    present = 0
    for i in range(n_nodes):
        present += s.nodes[i].present
    if present == 0:
        return
    P = s.P
    flush_updates(s, h)
    for k in range(c.d):
        mean = 0.0
        for r in range(c.n):
            w[r] = 0.0
        for i in range(n_nodes):
            if s.nodes[i].present:
                at = s.nodes[i].i_pos + k
                mean += s.x[h, at] / present
                for r in range(c.n):
                    w[r] += P[h, at, r] / present
        for i in range(n_nodes):
            if s.nodes[i].present:
                at = s.nodes[i].i_pos + k
                s.x[h, at] -= mean
                for r in range(c.n):
                    P[h, at, r] -= w[r]
        for r in range(c.n):
            total = 0.0
            for i in range(n_nodes):
                if s.nodes[i].present:
                    total += P[h, r, s.nodes[i].i_pos + k]
            for i in range(n_nodes):
                if s.nodes[i].present:
                    P[h, r, s.nodes[i].i_pos + k] -= total / present
        for i in range(n_nodes):
            for j in range(n_nodes):
                if s.nodes[i].present and s.nodes[j].present:
                    P[h, s.nodes[i].i_pos + k, s.nodes[j].i_pos + k] += c.centre_std**2
    symmetrise(P, h, c.n)


@kernel
def add_translation_uncertainty(c, s, h, members, m):
    """Add a common position variance of the members to P of hypothesis h."""
    for a in range(m):
        for b in range(m):
            at_a, at_b = s.nodes[members[a]].i_pos, s.nodes[members[b]].i_pos
            for k in range(c.d):
                s.P[h, at_a + k, at_b + k] += c.centre_std**2


@allocating_kernel
def heading_functional(s, h, but, A):
    """Write the functional that gives the rotation of the group in an error, by least squares.

    Args:
        s: JointState of one environment.
        h: Hypothesis.
        but: Node to leave out, or -1.
        A: (state), zeros, written: 1 / m for each position.

    Returns:
        Centre of the positions [m].
    """
    centre0, centre1, present = 0.0, 0.0, 0
    for i in range(s.nodes.shape[0]):
        if s.nodes[i].present and i != but:
            centre0 += s.x[h, s.nodes[i].i_pos]
            centre1 += s.x[h, s.nodes[i].i_pos + 1]
            present += 1
    centre0, centre1 = centre0 / max(present, 1), centre1 / max(present, 1)
    squared = 1e-9
    for i in range(s.nodes.shape[0]):
        if s.nodes[i].present and i != but:
            at = s.nodes[i].i_pos
            A[at], A[at + 1] = -(s.x[h, at + 1] - centre1), s.x[h, at] - centre0
            squared += A[at] * A[at] + A[at + 1] * A[at + 1]
    A /= squared
    return centre0, centre1


@allocating_kernel
def heading_variance(c, s, h):
    """Return the variance of the rotation of hypothesis h, which has no pending updates [rad2]."""
    A = np.zeros(c.n)
    heading_functional(s, h, -1, A)
    return A @ (s.P[h] @ A)


@allocating_kernel
def add_rotation_uncertainty(c, s, h, variance):
    """Add a variance of the rotation about every axis to P of hypothesis h.

    Args:
        c: Coefficients.
        s: JointState of one environment.
        h: Hypothesis without pending updates, updated.
        variance: Added variance [rad2].
    """
    n_axes, (mean, mean_v) = 3 if c.d == 3 else 1, group_centre(c, s, h)
    D = np.zeros((n_axes, c.n))
    for node in s.nodes:
        if node.present:
            write_tangents(D, node.i_pos, s.x[h, node.i_pos : node.i_pos + c.d] - mean)
        if node.present and not node.static:
            write_tangents(D, node.i_vel, s.x[h, node.i_vel : node.i_vel + c.d] - mean_v)
    # Clones (`smoothing`) of a time before any motion have the same rotation error.
    for r in range(min(c.n_motion, c.n - c.n_own)):
        D[:, c.n_own + r] = D[:, r]
    s.P[h] += variance * (D.T.copy() @ D)
