"""Merging of hypotheses that agree in every position relative to the centre of the group."""

from __future__ import annotations

import math

import numpy as np

from tracking.filters.joint.ekf.gauge import group_centre
from tracking.filters.joint.hypotheses.alignment import CHALLENGED, STATIC, has_modes
from tracking.filters.joint.hypotheses.alignment_sensitivity import has_linear_alignment
from tracking.kernels.jit import allocating_kernel


@allocating_kernel
def are_same(c, s, a, b, turn):
    """True if two hypotheses agree in position and velocity of every node about the centre.

    Velocities count over one second: a layout and its mirror image may coincide in a line, but they
    separate to different sides.

    Args:
        c: Coefficients.
        s: JointState of one environment.
        a: Hypothesis.
        b: Another hypothesis, rotated by `turn` before the comparison.
        turn: Orthogonal, (d, d).
    """
    # Modes are rotated copies of one filter, with linearisation errors.
    limit = c.merge_distance * (2.0 if has_modes(s.group[0]) else 1.0)
    (way, pace), (way_a, pace_a) = group_centre(c, s, b), group_centre(c, s, a)
    for i in range(s.nodes.shape[0]):
        node = s.nodes[i]
        if not node.present:
            continue
        squared = 0.0
        for at, of_b, of_a in ((node.i_pos, way, way_a), (node.i_vel, pace, pace_a)):
            if at < 0:
                continue
            for r in range(c.d):
                off = s.x[a, at + r] - of_a[r]
                for k in range(c.d):
                    off -= turn[r, k] * (s.x[b, at + k] - of_b[k])
                squared += off * off
        if squared > limit * limit:
            return False
    return True


@allocating_kernel
def rotation_between(c, s, a, b, turn):
    """Write the rotation of b that is nearest to a, by Procrustes, (d, d), unless it is large.

    Each rotation that was tried represents those near it. Two that differ by less than
    `AlignmentParams.same_rotation` are one, before motion shows which is better. While each
    represents all rotations and mirror images, in space, any rotation is written; while each is a
    mode, one below `AlignmentParams.same_mode`.
    """
    (way_a, _), (way_b, _) = group_centre(c, s, a), group_centre(c, s, b)
    scatter = np.zeros((c.d, c.d))
    for i in range(s.nodes.shape[0]):
        if s.nodes[i].present:
            at = s.nodes[i].i_pos
            for r in range(c.d):
                for k in range(c.d):
                    scatter[r, k] += (s.x[a, at + r] - way_a[r]) * (s.x[b, at + k] - way_b[k])
    u, _, v = np.linalg.svd(scatter)
    if has_linear_alignment(c, s) and STATIC <= s.group[0].alignment <= CHALLENGED:
        turn[:] = u @ v
        return
    if np.linalg.det(u) * np.linalg.det(v) < 0.0:
        u[:, c.d - 1] *= -1.0
    nearest = u @ v
    # The trace is 2 cos in the plane, 1 + 2 cos in space.
    limit = c.same_mode if has_modes(s.group[0]) else c.same_rotation
    if np.trace(nearest) > (c.d - 2) + 2.0 * math.cos(limit):
        turn[:] = nearest
