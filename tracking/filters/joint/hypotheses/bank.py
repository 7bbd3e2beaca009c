"""Bank of hypotheses about rotation and reflection: spawning, pruning, removal of nodes.

A layout and its mirror image have the same ranges; motion distinguishes them. While the nodes pass
through a line (or a plane, in space) the two coincide, and the filter may come out on the wrong
side. So the mirror image is filtered as well from there, until one is unlikely.

A hypothesis whose ranges fit badly for seconds is rotated or reflected wrongly, by a start or join
from few ranges: ranges alone fit any rotation, accelerations do not. Then all rotations and
reflections compete again. They also do if no motion has shown the rotation of a group in the plane
for long, as with cars that drive one behind the other.

References:
    [1] Alspach and Sorenson, Nonlinear Bayesian estimation using Gaussian sum approximations, IEEE
        Trans. Automatic Control 17 (1972) 439.
"""

from __future__ import annotations

import numpy as np

from tracking.filters.best_hypothesis import choose_best
from tracking.filters.first_ranges import forget_first
from tracking.filters.joint.ekf.gauge import heading_functional
from tracking.filters.joint.ekf.imu_errors import last_state
from tracking.filters.joint.ekf.observability import shift_nullspace
from tracking.filters.joint.ekf.scalar_update import flush_updates, reset_state
from tracking.filters.joint.hypotheses.alignment import (
    CANDIDATES,
    FILTERED,
    NONE,
    STATIC,
    has_modes,
    set_alignment,
)
from tracking.filters.joint.hypotheses.copying import copy_hypothesis, rotate_hypothesis
from tracking.filters.joint.hypotheses.geometric_degeneracy import (
    degeneracy_ratio,
    least_axis,
)
from tracking.filters.joint.hypotheses.initialisation import (
    initialise_pair,
)
from tracking.filters.joint.hypotheses.merging import are_same, rotation_between
from tracking.filters.joint.hypotheses.static_initialisation import TIE, spawn_rotations
from tracking.filters.joint.supervision.residuals import reset_residuals
from tracking.kernels.jit import allocating_kernel, kernel, small_kernel


@small_kernel
def flush_all_updates(s):
    """Apply the pending updates of every hypothesis."""
    for h in range(s.alive.shape[0]):
        if s.alive[h]:
            flush_updates(s, h)


@allocating_kernel
def add_mirror_image(c, s):
    """Add the mirror image of the best hypothesis to the bank, if it has room.

    It is mirrored across the line or plane nearest to the layout, velocities as well.
    """
    h = s.group[0].best
    target = copy_hypothesis(s, h)
    if target < 0:
        return
    across = least_axis(c, s, h)
    rotate_hypothesis(c, s, target, np.eye(c.d) - 2.0 * np.outer(across, across))


@kernel
def challenge(c, s, layout):
    """Spawn all rotations and mirror images again, in competition with the only hypothesis."""
    group = s.group[0]
    h = group.best
    group.misfit_limit = c.challenge_raise * max(group.misfit, group.misfit_limit)
    group.misfit = 0.0
    for i in range(s.nodes.shape[0]):
        node = s.nodes[i]
        if node.present and not node.static:
            for k in range(c.d):
                s.P[h, node.i_pos + k, node.i_pos + k] += c.challenge_position**2
                s.P[h, node.i_vel + k, node.i_vel + k] += c.challenge_speed**2
    for p in range(s.pairs.shape[0]):
        if s.nodes[s.pairs[p].i].present and s.nodes[s.pairs[p].j].present:
            initialise_pair(c, s, h, p, s.nlos[h, p])
    spawn_rotations(c, s, layout, h, 0.0)


@allocating_kernel
def split_rotation(c, s, layout, work):
    """Replace a hypothesis with too uncertain a rotation by all rotations and mirror images.

    So wide a Gaussian does not move as its mean does: it becomes a sum of narrow ones [1], each
    with the variance of a first rotation. They are as likely as its density says, but not less
    likely than by `challenger_penalty`, like mirror images.
    """
    group, A = s.group[0], np.zeros(c.n)
    h = group.best
    shift_nullspace(c, s, h, 1.0, work)  # by the latest corrections
    heading_functional(s, h, -1, A)
    w = s.P[h] @ A
    variance = A @ w
    s.P[h] -= np.outer(w, w) * ((1.0 - c.rotation_var / variance) / variance)
    s.loglik[h], group.heading_gauge_var = 0.0, c.rotation_var
    spawn_rotations(c, s, layout, h, variance)


@kernel
def needs_reflection(c, s):
    """True if a layout was degenerate and is regular again: its mirror image is as likely."""
    group = s.group[0]
    if group.n_alive != 1 or group.alignment < CANDIDATES:
        return False
    ratio = degeneracy_ratio(c, s, group.best, True)
    if ratio < c.degenerate:
        group.degenerate = (
            group.degenerate or degeneracy_ratio(c, s, group.best, False) < c.degenerate
        )
    elif group.degenerate and ratio > c.regular:
        group.degenerate = False
        return True
    return False


@allocating_kernel
def prune_bank(c, s):
    """Drop hypotheses that are unlikely or the same as a better one; choose the best."""
    group = s.group[0]
    if group.n_alive < 2:
        if group.alignment == CANDIDATES:
            set_alignment(group, FILTERED)
        return
    n_hyps = s.alive.shape[0]
    is_scored = group.alignment == STATIC or group.t >= group.t_scoring_starts - TIE
    best, changes = choose_best(s, c.report_lead if is_scored else np.inf)
    if changes:
        # Residuals were those of the other hypothesis.
        for p in range(s.pairs.shape[0]):
            reset_residuals(s.pairs[p])
        group.mean_nis = 1.0
    if not is_scored:
        for h in range(n_hyps):
            s.loglik[h] = 0.0
    top = s.loglik[best]
    for h in range(n_hyps):
        if s.alive[h] and h != group.best and s.loglik[h] < top - c.prune:
            s.alive[h] = False
    turn = np.eye(c.d)
    for a in range(n_hyps):
        for b in range(n_hyps):
            better = s.loglik[a] >= s.loglik[b] or a == group.best
            if a == b or b == group.best or not (s.alive[a] and s.alive[b] and better):
                continue
            turn[:] = np.eye(c.d)
            if a == group.best or has_modes(group):
                rotation_between(c, s, a, b, turn)
            if are_same(c, s, a, b, turn):
                s.alive[b] = False
    group.n_alive = 0
    for h in range(n_hyps):
        group.n_alive += s.alive[h]
        s.loglik[h] -= top


@kernel
def remove_node(c, s, layout, i):
    """Remove a node from the group, and all nodes if fewer than two remain."""
    node = s.nodes[i]
    node.present, node.seen = False, False
    node.fault = 0
    n_present = 0
    for k in range(s.nodes.shape[0]):
        n_present += s.nodes[k].present
        if k != i:
            pair = s.pairs[layout.pair_index[i, k]]
            pair.n_ranges = 0
            forget_first(pair)
    for h in range(s.alive.shape[0]):
        if s.alive[h]:
            for r in range(node.i_pos, node.i_pos + (c.d if node.static else 2 * c.d)):
                s.accumulated_correction[h, r] = 0.0
                reset_state(s, h, c.n, r, 1.0)
            for r in range(
                node.i_tilt_bias, node.i_tilt_bias if node.static else last_state(node) + 1
            ):
                reset_state(s, h, c.n, r, 1.0)
            for k in range(s.nodes.shape[0]):
                at = s.pairs[layout.pair_index[i, k]].i_range_error if k != i else -1
                if at >= 0:
                    reset_state(s, h, c.n, at, 1.0)
                    reset_state(s, h, c.n, at + 1, 1.0)
    if n_present < 2:
        for k in range(s.nodes.shape[0]):
            s.nodes[k].present, s.nodes[k].seen = False, False
            s.nodes[k].fault = 0
        s.alive[:] = False
        s.group[0].n_alive = 0
        set_alignment(s.group[0], NONE)


@kernel
def has_timed_out(c, node, t):
    """True for a node that has had no range for `node_timeout`: it has left."""
    return (node.present or node.seen) and t - node.t_last_range > c.node_timeout


@kernel
def any_timed_out(c, s, t):
    """True if a node has timed out."""
    n = 0
    for i in range(s.nodes.shape[0]):
        n += has_timed_out(c, s.nodes[i], t)
    return n > 0


@kernel
def drop_timed_out(c, s, layout, t):
    """Remove the nodes that have timed out."""
    for i in range(s.nodes.shape[0]):
        if has_timed_out(c, s.nodes[i], t):
            remove_node(c, s, layout, i)
