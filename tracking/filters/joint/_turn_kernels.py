"""How a group in the plane is turned: how uncertain that is, and what turns with it.

Until a group has driven, nothing tells its rotation but that one of those tried is near. Ranges
to nodes at rest do not make it more certain, nor does a node that joins. What a filter believes
all the same, by derivatives that are a little out of date, leaves it degrees off when the group
begins to move.

In space rotations are as uncertain as starts and ranges leave them: those tried are up to 63
degrees from the right one, and filters that may turn so far settle later, and sometimes on a wrong
one.
"""

from __future__ import annotations

import numpy as np

from tracking.compiled import allocating_kernel

UNSURE = 0.05
"""[rad] A turn that is less certain than this is looked after at every range."""


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
def note_turn(c, s):
    """Keep how uncertain the turn of the reported hypothesis is."""
    if c.d == 2:
        A = np.zeros(c.n)
        read_turn(s, s.group[0].best, -1, A)
        s.group[0].turn_var = A @ (s.P[s.group[0].best] @ A)


@allocating_kernel
def spread_turn(c, s, h):
    """Add the gap between two of the rotations that are tried to what is not known of h."""
    if c.d == 3:
        return
    D, present, moving = np.zeros(c.n), 0, 0
    mean, mean_v = np.zeros(2), np.zeros(2)
    for i in range(s.nodes.shape[0]):
        node = s.nodes[i]
        if node.present:
            present += 1
            mean += s.x[h, node.at_p : node.at_p + 2]
            if not node.static:
                moving += 1
                mean_v += s.x[h, node.at_v : node.at_v + 2]
    mean /= max(present, 1)
    # Beside static nodes velocities are not free to shift.
    mean_v *= 1.0 / max(moving, 1) if moving == present else 0.0
    for i in range(s.nodes.shape[0]):
        node = s.nodes[i]
        if node.present:
            p, v = node.at_p, node.at_v
            D[p], D[p + 1] = -(s.x[h, p + 1] - mean[1]), s.x[h, p] - mean[0]
            if not node.static:
                D[v], D[v + 1] = -(s.x[h, v + 1] - mean_v[1]), s.x[h, v] - mean_v[0]
    for r in range(c.n):
        for k in range(c.n):
            s.P[h, r, k] += c.rotation_var * D[r] * D[k]
    s.group[0].turn_var = max(s.group[0].turn_var, c.rotation_var)
