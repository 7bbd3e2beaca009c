"""Static initialisation: groups in which no node has moved yet.

Ranges observe neither the rotation of a layout nor its reflection, and accelerations of nodes at
rest do not either: until something moves, all hypotheses of the bank are one, rotated. So one is
filtered, and the others are spawned from it when the first node moves.
"""

from __future__ import annotations

import math

import numpy as np

from tracking.filters.joint.ekf.gauge import add_rotation_uncertainty, heading_variance
from tracking.filters.joint.ekf.observability import shift_nullspace
from tracking.filters.joint.ekf.scalar_update import reset_state
from tracking.filters.joint.hypotheses.alignment import FILTERED, LINEAR, set_alignment
from tracking.filters.joint.hypotheses.alignment_sensitivity import has_linear_alignment
from tracking.filters.joint.hypotheses.copying import copy_hypothesis, rotate_hypothesis
from tracking.kernels.jit import allocating_kernel, kernel, small_kernel

TIE = 1e-6
"""[s] Times that differ by less are equal, whatever the origin of the clock."""


@small_kernel
def is_at_rest(c, node, t):
    """True for a node whose IMU has shown no motion for `rest_after`."""
    if not node.has_state or t - node.t_state > c.imu_timeout:
        return False
    return node.rests and t - node.t_moved > c.rest_after


@small_kernel
def all_static(c, s, t):
    """True if no present node has been seen to move since its first sample."""
    for i in range(s.nodes.shape[0]):
        node = s.nodes[i]
        if not node.present or node.static:
            continue
        if not node.has_state or t - node.t_state > c.imu_timeout:
            return False
        if (
            node.t_accelerated - node.t_first > c.settling
            or node.t_moved - node.t_first > c.orienting
        ):
            return False
    return True


@small_kernel
def may_move(c, s, t):
    """True while samples of a present node are too few to show whether it moves."""
    for i in range(s.nodes.shape[0]):
        node = s.nodes[i]
        if node.present and not node.static and is_settling(c, node, t):
            return True
    return False


@small_kernel
def is_settling(c, node, t):
    """True until a node has a sample that shows whether it moves, or is silent."""
    if t - node.t_first <= c.settling:
        return True
    return t - node.t_state <= c.imu_timeout and node.t_state - node.t_first <= c.settling


@allocating_kernel
def spawn_rotation_hypotheses(c, s, layout, work):
    """Spawn all rotations and mirror images, as the first node moves.

    In space one filter represents all of them: its alignment is started next.

    If a joined node may be on two sides there are two layouts; in the plane the bank has room for a
    few rotations of the second.
    """
    group = s.group[0]
    opens = has_linear_alignment(c, s)
    set_alignment(group, LINEAR if opens else FILTERED)
    group.undecided = not opens
    if group.t > group.t_scoring_starts - c.wheels_after + c.rest_time + TIE:
        group.t_scoring_starts = group.t
    was_alive = s.alive.copy()
    for h in range(s.alive.shape[0]):
        for i in range(s.nodes.shape[0]):
            node = s.nodes[i]
            # Heading errors are constant while no node moves.
            if was_alive[h] and node.present and not node.static:
                reset_state(s, h, c.n, node.i_heading, node.first_heading_var)
        if was_alive[h]:
            reset_heading_uncertainty(c, s, h, work)
    if opens:
        return
    for _ in range(s.alive.shape[0]):
        # The likelier layout first.
        original = -1
        for h in range(s.alive.shape[0]):
            if was_alive[h] and (original < 0 or s.loglik[h] > s.loglik[original]):
                original = h
        if original < 0:
            return
        was_alive[original] = False
        spawn_rotations(c, s, layout, original, math.inf)


@kernel
def reset_heading_uncertainty(c, s, h, work):
    """Raise the rotation variance of hypothesis h to that of a first rotation, in the plane.

    In space it stays as the start and ranges left it (`gauge`).
    """
    if c.d == 2:
        shift_nullspace(c, s, h, 1.0, work)  # by the latest corrections
        add_rotation_uncertainty(c, s, h, max(c.rotation_var - heading_variance(c, s, h), 0.0))
        s.group[0].heading_gauge_var = max(s.group[0].heading_gauge_var, c.rotation_var)


@allocating_kernel
def spawn_rotations(c, s, layout, original, variance):
    """Copy a hypothesis in all other rotations and mirrored, while the bank has room.

    Each is less likely by its angle in a Gaussian of this variance [rad2], by `challenger_penalty`
    at most, like mirror images; all are equally likely if it is infinite.
    """
    d = c.d
    first = layout.rotations[0, :d, :d].copy()
    for r in range(1, layout.rotations.shape[0]):
        h = copy_hypothesis(s, original)
        if h >= 0:
            turn = layout.rotations[r, :d, :d].copy() @ first.T.copy()
            rotate_hypothesis(c, s, h, np.ascontiguousarray(turn))
            angle, penalty = math.acos(min(max(turn[0, 0], -1.0), 1.0)), c.challenger_penalty
            if variance == math.inf:
                penalty = 0.0
            elif d == 2 and np.linalg.det(turn) > 0.0 and variance > 0.0:
                penalty = min(0.5 * angle * angle / variance, penalty)
            s.loglik[h] -= penalty
