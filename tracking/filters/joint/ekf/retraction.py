"""Retraction of a move of a group in space: what is a rotation in it goes round the centre.

A linear update moves every node straight ahead along its tangent, which is a rotation and a
stretch of ``1 - cos`` of it.
"""

from __future__ import annotations

import math

from tracking.kernels.jit import small_kernel


@small_kernel
def retract_rotation(s, h, centre, A, idx, m):
    """Let what is a rotation of the group in a move go round the centre instead of straight ahead.

    Args:
        s: JointState of one environment, in space; `x` and `accumulated_correction` are updated.
        h: Hypothesis.
        centre: Before the move, three numbers [m].
        A: What reads the rotation off a move, (axis, state).
        idx: States of positions.
        m: How many.
    """
    w0, w1, w2 = 0.0, 0.0, 0.0
    for r in range(m):
        move = s.accumulated_correction[h, idx[r]]
        w0, w1, w2 = w0 + A[2, idx[r]] * move, w1 + A[1, idx[r]] * move, w2 + A[0, idx[r]] * move
    angle = math.sqrt(w0 * w0 + w1 * w1 + w2 * w2)
    # Rodrigues' formula without what a move has already: R a - a - w x a.
    first = math.sin(angle) / angle - 1.0 if angle > 1e-9 else 0.0
    second = (1.0 - math.cos(angle)) / (angle * angle) if angle > 1e-9 else 0.5
    for i in range(s.nodes.shape[0]):
        node = s.nodes[i]
        for at, share in ((node.i_pos, 1.0), (node.i_vel, 0.0)):
            if not node.present or at < 0:
                continue
            a0 = s.x[h, at] - s.accumulated_correction[h, at] - share * centre[0]
            a1 = s.x[h, at + 1] - s.accumulated_correction[h, at + 1] - share * centre[1]
            a2 = s.x[h, at + 2] - s.accumulated_correction[h, at + 2] - share * centre[2]
            c0, c1, c2 = w1 * a2 - w2 * a1, w2 * a0 - w0 * a2, w0 * a1 - w1 * a0
            change = (
                first * c0 + second * (w1 * c2 - w2 * c1),
                first * c1 + second * (w2 * c0 - w0 * c2),
                first * c2 + second * (w0 * c1 - w1 * c0),
            )
            for k in range(3):
                s.x[h, at + k] += change[k]
                s.accumulated_correction[h, at + k] += change[k]
