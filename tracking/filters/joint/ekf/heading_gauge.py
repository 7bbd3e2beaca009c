"""Rotation of a group in the plane: its uncertainty, and what turns with it.

Until a group has driven, its rotation is known only as near as the nearest of those tried. Ranges
to nodes at rest do not measure it, nor does a node that joins. A filter becomes certain of it all
the same, by derivatives that are a little out of date, and is degrees off when the group begins to
move.

In space one filter stands for all rotations until they are known (`alignment_sensitivity`).
"""

from __future__ import annotations

import numpy as np

from tracking.filters.joint.ekf.group_centre import group_centre
from tracking.filters.joint.ekf.observability import write_tangents
from tracking.kernels.jit import allocating_kernel, kernel


@allocating_kernel
def heading_functional(s, h, but, A):
    """Write what reads the turn of the group off an error of hypothesis h, by least squares.

    Args:
        s: JointState of one environment.
        h: Hypothesis.
        but: A node to leave out, or -1.
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
    """Variance of the rotation of hypothesis h, which has no pending updates [rad2]."""
    A = np.zeros(c.n)
    heading_functional(s, h, -1, A)
    return A @ (s.P[h] @ A)


@kernel
def update_heading_variance(c, s):
    """Keep how uncertain the turn of the reported hypothesis is."""
    if c.d == 2:
        s.group[0].heading_gauge_var = heading_variance(c, s, s.group[0].best)


@allocating_kernel
def add_rotation_uncertainty(c, s, h, variance):
    """Make it less certain how hypothesis h is turned, about every axis.

    Args:
        c: Coefficients.
        s: JointState of one environment.
        h: Hypothesis without pending updates, updated.
        variance: What is added [rad2].
    """
    n_axes, (mean, mean_v) = 3 if c.d == 3 else 1, group_centre(c, s, h)
    D = np.zeros((n_axes, c.n))
    for node in s.nodes:
        if node.present:
            write_tangents(D, node.i_pos, s.x[h, node.i_pos : node.i_pos + c.d] - mean)
        if node.present and not node.static:
            write_tangents(D, node.i_vel, s.x[h, node.i_vel : node.i_vel + c.d] - mean_v)
    # Clones of a time at which no node had moved either are rotated alike (`smoothing`).
    for r in range(min(c.n_motion, c.n - c.n_own)):
        D[:, c.n_own + r] = D[:, r]
    s.P[h] += variance * (D.T.copy() @ D)
