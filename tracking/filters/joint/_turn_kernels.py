"""How a group in the plane is turned: how uncertain that is, and what turns with it.

Until a group has driven, nothing tells its rotation but that one of those tried is near. Ranges
to nodes at rest do not make it more certain, nor does a node that joins. What a filter believes
all the same, by derivatives that are a little out of date, leaves it degrees off when the group
begins to move.

In space one filter stands for all turns until they are known (`_open_kernels`).
"""

from __future__ import annotations

import numpy as np

from tracking.jit import allocating_kernel, kernel


@allocating_kernel
def read_turn(s, h, but, A):
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
            centre0 += s.x[h, s.nodes[i].at_p]
            centre1 += s.x[h, s.nodes[i].at_p + 1]
            present += 1
    centre0, centre1 = centre0 / max(present, 1), centre1 / max(present, 1)
    squared = 1e-9
    for i in range(s.nodes.shape[0]):
        if s.nodes[i].present and i != but:
            at = s.nodes[i].at_p
            A[at], A[at + 1] = -(s.x[h, at + 1] - centre1), s.x[h, at] - centre0
            squared += A[at] * A[at] + A[at + 1] * A[at + 1]
    A /= squared
    return centre0, centre1


@allocating_kernel
def turn_variance(c, s, h):
    """How uncertain the turn of hypothesis h is, nothing of which waits [rad2]."""
    A = np.zeros(c.n)
    read_turn(s, h, -1, A)
    return A @ (s.P[h] @ A)


@kernel
def note_turn(c, s):
    """Keep how uncertain the turn of the reported hypothesis is."""
    if c.d == 2:
        s.group[0].turn_var = turn_variance(c, s, s.group[0].best)


@allocating_kernel
def spread_turn(c, s, h, variance):
    """Make it less certain how hypothesis h is turned, about every axis.

    Args:
        c: Coefficients.
        s: JointState of one environment.
        h: Hypothesis, updated; nothing of it waits.
        variance: What is added [rad2].
    """
    mean, mean_v, present, moving = np.zeros(3), np.zeros(3), 0, 0
    for i in range(s.nodes.shape[0]):
        node = s.nodes[i]
        if node.present:
            present += 1
            mean[: c.d] += s.x[h, node.at_p : node.at_p + c.d]
            if not node.static:
                moving += 1
                mean_v[: c.d] += s.x[h, node.at_v : node.at_v + c.d]
    mean /= max(present, 1)
    # Beside static nodes velocities are not free to shift.
    mean_v *= 1.0 / max(moving, 1) if moving == present else 0.0
    D = np.zeros(c.n)
    for axis in range(3 if c.d == 3 else 1):
        u, v = (3 - axis) % 3, (4 - axis) % 3  # z first: the only axis of the plane
        D[:] = 0.0
        for i in range(s.nodes.shape[0]):
            node = s.nodes[i]
            if node.present:
                D[node.at_p + u] = -(s.x[h, node.at_p + v] - mean[v])
                D[node.at_p + v] = s.x[h, node.at_p + u] - mean[u]
                if not node.static:
                    D[node.at_v + u] = -(s.x[h, node.at_v + v] - mean_v[v])
                    D[node.at_v + v] = s.x[h, node.at_v + u] - mean_v[u]
        # Clones of a moment in which nobody had moved either are turned alike (`smoothing`).
        for r in range(min(c.n_motion, c.n - c.n_own)):
            D[c.n_own + r] = D[r]
        for r in range(c.n):
            for k in range(c.n):
                s.P[h, r, k] += variance * D[r] * D[k]
