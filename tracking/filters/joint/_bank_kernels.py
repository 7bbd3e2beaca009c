"""The bank of hypotheses: mirror images that become possible, and which ones are kept.

A layout and its mirror image have the same ranges; motion tells them apart. While the nodes
pass through a line (or a plane, in space) the two are one, and the filter may come out on the
wrong side. So its mirror image is followed beside it from there, until one is unlikely.

What fits badly for seconds on end is turned or mirrored, by a start or join that few ranges
decided: ranges alone fit any rotation, but moves that go elsewhere than the IMUs say do not.
Then all rotations and mirror images are followed again.
"""

from __future__ import annotations

import numpy as np

from tracking._exponential_kernels import decay
from tracking.jit import allocating_kernel, kernel, small_kernel
from tracking.filters._shape_kernels import forget_first
from tracking.filters.joint._agreement_kernels import are_same, turn_between
from tracking.filters.joint._alignment_kernels import CANDIDATES, FILTERED, NONE, STATIC, has_modes
from tracking.filters.joint._copy_kernels import copy_hypothesis, turn_hypothesis
from tracking.filters.joint._flatness_kernels import flatness, least_axis, scatter_of
from tracking.filters.joint._frame_kernels import doubt_turn
from tracking.filters.joint._gyroscope_kernels import last_state
from tracking.filters.joint._linear_kernels import decouple
from tracking.filters.joint._open_kernels import can_open
from tracking.filters.joint._sleep_kernels import TIE, turn_all_ways
from tracking.filters.joint._start_kernels import begin_pair, forget_fits


@small_kernel
def bank_range(s):
    """Hypotheses to go through: all, or the only one."""
    group = s.group[0]
    if group.n_alive > 1:
        return 0, s.alive.shape[0]
    return group.best, group.best + 1


@allocating_kernel
def add_mirror_image(c, s):
    """Make the mirror image of the reported hypothesis one, if the bank has room.

    It is mirrored across the line or plane that the layout is nearest to, velocities as well.
    """
    h, d = s.group[0].best, c.d
    target = copy_hypothesis(s, h)
    if target < 0:
        return
    M = np.eye(d)
    scatter, _ = scatter_of(c, s, h)
    _, across = least_axis(scatter, d)
    for r in range(d):
        for k in range(d):
            M[r, k] -= 2.0 * across[r] * across[k]
    turn_hypothesis(c, s, target, M)


@kernel
def watch_rotation(c, s, layout, dt):
    """Follow all rotations and mirror images again where ranges have fitted badly for long."""
    group = s.group[0]
    group.strain += (1.0 - decay(dt / c.misfit_time)) * (group.misfit - group.strain)
    group.strain_limit += (1.0 - decay(dt / c.challenge_time)) * (c.strained - group.strain_limit)
    watched = group.n_alive == 1 and group.alignment >= CANDIDATES
    if not watched or group.strain < group.strain_limit:
        return
    n_doubted = 0
    for i in range(s.nodes.shape[0]):
        n_doubted += s.nodes[i].present and s.nodes[i].doubted
    # A single node that contradicts the others is to blame, and not the layout.
    if n_doubted == 1:
        return
    h = group.best
    if flatness(c, s, h, True) == np.inf:
        return
    if can_open(c, s):
        group.strain = 0.0
        doubt_turn(c, s, layout, h)
        return
    group.strain_limit = c.challenge_raise * max(group.strain, group.strain_limit)
    group.strain = 0.0
    for i in range(s.nodes.shape[0]):
        node = s.nodes[i]
        if node.present and not node.static:
            for k in range(c.d):
                s.P[h, node.at_p + k, node.at_p + k] += c.challenge_position**2
                s.P[h, node.at_v + k, node.at_v + k] += c.challenge_speed**2
    for p in range(s.pairs.shape[0]):
        if s.nodes[s.pairs[p].i].present and s.nodes[s.pairs[p].j].present:
            begin_pair(c, s, h, p, s.nlos[h, p])
    turn_all_ways(c, s, layout, h)
    for k in range(s.alive.shape[0]):
        if s.alive[k] and k != h:
            s.loglik[k] -= c.head_start


@kernel
def watch_mirror(c, s):
    """Bring the mirror image up where it can no longer be excluded."""
    group = s.group[0]
    if group.n_alive != 1 or group.alignment < CANDIDATES:
        return
    ratio = flatness(c, s, group.best, True)
    if ratio < c.degenerate:
        group.degenerate = group.degenerate or flatness(c, s, group.best, False) < c.degenerate
    elif group.degenerate and ratio > c.regular:
        group.degenerate = False
        add_mirror_image(c, s)


@allocating_kernel
def prune_bank(c, s):
    """Drop hypotheses that are unlikely or the same as a better one; choose the best."""
    group = s.group[0]
    if group.n_alive < 2:
        if group.alignment == CANDIDATES:
            group.alignment = FILTERED
        return
    n_hyps = s.alive.shape[0]
    if group.alignment != STATIC and group.t < group.t_patient - TIE:
        for h in range(n_hyps):
            s.loglik[h] = 0.0
    best = -1
    for h in range(n_hyps):
        if s.alive[h] and (best < 0 or s.loglik[h] > s.loglik[best]):
            best = h
    # The report changes only for a clear gain, or equal hypotheses would take turns.
    if not s.alive[group.best] or s.loglik[best] > s.loglik[group.best] + 2.0:
        group.best = best
        # How well ranges fit was told by the other.
        for p in range(s.pairs.shape[0]):
            forget_fits(s.pairs[p])
        group.misfit = 1.0
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
                turn_between(c, s, a, b, turn)
            if are_same(c, s, a, b, turn):
                s.alive[b] = False
    group.n_alive = 0
    for h in range(n_hyps):
        group.n_alive += s.alive[h]
        s.loglik[h] -= top


@kernel
def remove_node(c, s, layout, i):
    """Forget a node that left."""
    node = s.nodes[i]
    node.present, node.heard = False, False
    node.astray, node.doubted = 0.0, False
    n_present = 0
    for k in range(s.nodes.shape[0]):
        n_present += s.nodes[k].present
        if k != i:
            pair = s.pairs[layout.pair_index[i, k]]
            pair.n_ranges = 0
            forget_first(pair)
    for h in range(s.alive.shape[0]):
        if s.alive[h]:
            for r in range(node.at_p, node.at_p + (c.d if node.static else 2 * c.d)):
                s.moved[h, r] = 0.0
                decouple(s, h, c.n, r, 1.0)
            for r in range(node.at_b, node.at_b if node.static else last_state(node) + 1):
                decouple(s, h, c.n, r, 1.0)
            for k in range(s.nodes.shape[0]):
                at = s.pairs[layout.pair_index[i, k]].at_e if k != i else -1
                if at >= 0:
                    decouple(s, h, c.n, at, 1.0)
                    decouple(s, h, c.n, at + 1, 1.0)
    if n_present < 2:
        for k in range(s.nodes.shape[0]):
            s.nodes[k].present, s.nodes[k].heard = False, False
            s.nodes[k].astray, s.nodes[k].doubted = 0.0, False
        s.alive[:] = False
        s.group[0].n_alive = 0
        s.group[0].alignment = NONE


@kernel
def remove_silent(c, s, layout, t):
    """Remove the nodes that were not heard for so long that they must have left."""
    for i in range(s.nodes.shape[0]):
        if (s.nodes[i].present or s.nodes[i].heard) and t - s.nodes[i].t_heard > c.leave_after:
            remove_node(c, s, layout, i)
