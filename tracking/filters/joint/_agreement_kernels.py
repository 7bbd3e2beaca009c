"""When two hypotheses are one: they put every node in the same place round the centre."""

from __future__ import annotations

import math

from tracking.compiled import kernel, small_kernel

SAME_TURN = 0.15
"""[rad] Hypotheses that differ by a smaller turn of the group only are one. The rotations that are
tried in the plane are 0.39 rad apart."""


@kernel
def are_same(c, s, a, b, turn):
    """True when two hypotheses agree in position and velocity of every node round the centre.

    Velocities count over one second: a layout and its mirror image may meet in a line, but
    they go on to different sides.

    Args:
        c: Coefficients.
        s: JointState of one environment.
        a: Hypothesis.
        b: Another, turned about the vertical before it is compared,
        turn: by so much [rad].
    """
    cos_t, sin_t = math.cos(turn), math.sin(turn)
    way, pace = centre_of(c, s, b, False), centre_of(c, s, b, True)
    way_a, pace_a = centre_of(c, s, a, False), centre_of(c, s, a, True)
    for i in range(s.nodes.shape[0]):
        node = s.nodes[i]
        if not node.present:
            continue
        squared = 0.0
        for at, of_b, of_a in ((node.at_p, way, way_a), (node.at_v, pace, pace_a)):
            if at < 0:
                continue
            b0, b1 = s.x[b, at] - of_b[0], s.x[b, at + 1] - of_b[1]
            squared += (s.x[a, at] - of_a[0] - cos_t * b0 + sin_t * b1) ** 2
            squared += (s.x[a, at + 1] - of_a[1] - sin_t * b0 - cos_t * b1) ** 2
            if c.d == 3:
                squared += (s.x[a, at + 2] - of_a[2] - s.x[b, at + 2] + of_b[2]) ** 2
        if squared > c.merge_distance**2:
            return False
    return True


@kernel
def turn_between(c, s, a, b):
    """By how much b is to be turned about the vertical to be nearest to a [rad]; 0 where it is far.

    Each rotation that was tried stands for those near it. Two of them that have come nearer than
    `SAME_TURN` are one, and nobody should wait until a drive tells which is better.
    """
    way_a, way_b = centre_of(c, s, a, False), centre_of(c, s, b, False)
    dot, cross = 0.0, 0.0
    for i in range(s.nodes.shape[0]):
        if s.nodes[i].present:
            at = s.nodes[i].at_p
            a0, a1 = s.x[a, at] - way_a[0], s.x[a, at + 1] - way_a[1]
            b0, b1 = s.x[b, at] - way_b[0], s.x[b, at + 1] - way_b[1]
            dot += a0 * b0 + a1 * b1
            cross += b0 * a1 - b1 * a0
    turn = math.atan2(cross, dot)
    return turn if abs(turn) < SAME_TURN else 0.0


@small_kernel
def centre_of(c, s, h, of_velocities):
    """Where hypothesis h puts the centre of the group, or how it moves, three numbers.

    Beside static nodes, velocities have no common part that is free: 0.
    """
    total0, total1, total2, present, moving = 0.0, 0.0, 0.0, 0, 0
    for i in range(s.nodes.shape[0]):
        node = s.nodes[i]
        if node.present:
            present += 1
            moving += not node.static
            at = node.at_v if of_velocities else node.at_p
            if not (of_velocities and node.static):
                total0 += s.x[h, at]
                total1 += s.x[h, at + 1]
                if c.d == 3:
                    total2 += s.x[h, at + 2]
    if present == 0 or (of_velocities and moving != present):
        return 0.0, 0.0, 0.0
    return total0 / present, total1 / present, total2 / present
