"""Modes of the rotation of a group in space, each with its own filter.

At first one filter represents all rotations (`alignment_sensitivity`), and its frame is rotated to
the likeliest mode ten times a second, which is reported. But headings and sensor offsets rotate
with the body, so their estimates are right for one rotation only, and so are the gains once either
matters. So once each mode is known roughly, it is filtered in a frame of its own, by the likelihood
of later measurements, and follows the maximum near it: a Gaussian sum [1] over rotations. As long
as all is linear its members have one covariance, so their fit decides between them, not their
covariance. Once all are known to a few degrees, the remaining rotation error becomes a part of P,
and frames are rotated no more.

References:
    [1] Alspach and Sorenson, Nonlinear Bayesian estimation using Gaussian sum approximations, IEEE
        Trans. Automatic Control 17 (1972) 439.
"""

from __future__ import annotations

import math

import numpy as np

from tracking.filters.joint.hypotheses.alignment import (
    CANDIDATES,
    CHALLENGED,
    FILTERED,
    LINEAR,
    MODES,
    set_alignment,
)
from tracking.filters.joint.hypotheses.alignment_sensitivity import (
    small_rotation_derivatives,
    start_alignment,
    update_alignment_cov,
)
from tracking.filters.joint.hypotheses.copying import copy_hypothesis, rotate_block
from tracking.filters.joint.hypotheses.static_initialisation import TIE
from tracking.kernels.jit import allocating_kernel
from tracking.maths.rotation_modes import (
    climb_to_mode,
    curvature,
    find_modes,
    gain,
    inverse,
    is_near,
    least_curvature,
    rotation_exp,
)


@allocating_kernel
def challenge_alignment(c, s, layout):
    """Search for other rotations of the only hypothesis, which stays until one is likelier.

    Other rotations start with a lower likelihood, mirror images by `challenger_penalty`.
    """
    h = s.group[0].best
    set_alignment(s.group[0], CHALLENGED)
    start_alignment(c, s, layout, h)
    for k in range(9):
        s.alignment_information[h, k, k] += 0.5 * c.challenger_penalty
    update_alignment_cov(c, s, h)
    s.group[0].misfit = 0.0


@allocating_kernel
def monitor_modes(c, s, layout):
    """Rotate frames to the likeliest rotations; follow each by itself once all are known."""
    group, was_alive = s.group[0], s.alive.copy()
    if group.t < group.t_scoring_starts - TIE:
        # No likelihood counts yet.
        set_alignment(group, LINEAR)
        for h in range(s.alive.shape[0]):
            if was_alive[h]:
                start_alignment(c, s, layout, h)
        return
    if group.alignment == CHALLENGED and group.n_alive == 1:
        resolve_challenge(c, s, layout)
    elif group.alignment == MODES:
        refine_modes(c, s)
    else:
        set_alignment(group, LINEAR)
        track_all_modes(c, s, layout)


@allocating_kernel
def resolve_challenge(c, s, layout):
    """Replace a challenged rotation once another is clearly likelier; keep it after a while."""
    group, R, H = s.group[0], np.eye(3), np.zeros((3, 3))
    value = climb_to_mode(s.alignment_information[group.best], s.alignment_score[group.best], R, H)
    turns, values = likely_modes(c, s, layout, group.best)
    if values[0] > value + c.challenger_lead:
        R[:], value = turns[0], values[0]
    if value < c.challenger_lead or is_near(R, np.eye(3), c.same_mode):
        # A mode near it uses the data of the challenge only; the filter is more accurate.
        if len(values) == 1 or group.t - group.t_alignment > c.challenge_longest:
            set_alignment(group, FILTERED)
        return
    set_alignment(group, MODES)
    spawn_modes(c, s, group.best, turns, values)


@allocating_kernel
def track_all_modes(c, s, layout):
    """Rotate every frame to its likeliest mode; spawn the modes once each is known roughly."""
    was_alive, known, H = s.alive.copy(), True, np.zeros((3, 3))
    for h in range(s.alive.shape[0]):
        if not was_alive[h]:
            continue
        R = np.eye(3)
        value = climb_to_mode(s.alignment_information[h], s.alignment_score[h], R, H)
        turns, values = likely_modes(c, s, layout, h)
        if values[0] > value + c.mode_lead:
            R[:] = turns[0]
        for a in range(len(values)):
            climb_to_mode(s.alignment_information[h], s.alignment_score[h], turns[a], H)
            known = known and least_curvature(H) > c.mode_std**-2
        rotate_frame(c, s, h, R)
        update_alignment_cov(c, s, h)
    if not known:
        return
    set_alignment(s.group[0], MODES)
    for h in range(s.alive.shape[0]):
        if was_alive[h]:
            turns, values = likely_modes(c, s, layout, h)
            spawn_modes(c, s, h, turns, values)


@allocating_kernel
def likely_modes(c, s, layout, h):
    """Return the likely modes of hypothesis h, (mode, 3, 3), and log-likelihoods, best first."""
    turns, values = find_modes(
        s.alignment_information[h], s.alignment_score[h], layout.rotations, c.same_mode
    )
    n = 1
    while n < len(values) and values[n] > values[0] - c.prune:
        n += 1
    return turns[:n], values[:n]


@allocating_kernel
def spawn_modes(c, s, h, turns, values):
    """Copy hypothesis h for each mode, with the mode's log-likelihood, while the bank has room."""
    for k in range(len(values)):
        a = (k + 1) % len(values)  # h itself last
        target = copy_hypothesis(s, h) if a > 0 else h
        if target >= 0:
            s.loglik[target] += values[a]
            rotate_frame(c, s, target, turns[a].copy())
            update_alignment_cov(c, s, target)


@allocating_kernel
def refine_modes(c, s):
    """Rotate every frame to the mode near it; make them candidates once all are known."""
    known = True
    for h in range(s.alive.shape[0]):
        if s.alive[h]:
            known = move_to_mode(c, s, h) and known
            update_alignment_cov(c, s, h)
    if not known:
        return
    set_alignment(s.group[0], CANDIDATES)
    for h in range(s.alive.shape[0]):
        if s.alive[h]:
            add_mode_uncertainty(c, s, h)


@allocating_kernel
def move_to_mode(c, s, h):
    """Rotate the frame of hypothesis h to the mode near it; return whether that is known."""
    g, w, H, J = np.zeros(9), np.zeros(3), np.zeros((3, 3)), small_rotation_derivatives()
    curvature(s.alignment_information[h], np.eye(3), s.alignment_score[h], w, H)
    known = least_curvature(H) > c.candidate_std**-2
    # Only about axes with more information than that of `mode_std`.
    values, axes = np.linalg.eigh(J @ (s.alignment_information[h] @ J.T.copy()))
    move = np.zeros(3)
    for a in range(3):
        if values[a] > c.mode_std**-2:
            axis = axes[:, a].copy()
            move += axis * (np.sum(axis * w) / values[a])
    length = math.sqrt(np.sum(move * move))
    R = rotation_exp(move * min(1.0, c.mode_std / max(length, c.mode_step)))
    if length > c.mode_step and gain(s.alignment_information[h], s.alignment_score[h], R, g) > 0.0:
        rotate_frame(c, s, h, R)
    return known


@allocating_kernel
def rotate_frame(c, s, h, R):
    """Rotate the frame of hypothesis h so that the rotation R becomes the identity."""
    d = np.zeros(9)
    for k in range(9):
        d[k] = R[k // 3, k % 3] - (1.0 if k % 4 == 0 else 0.0)
    change = s.alignment_information[h] @ d
    # M = R M': derivatives by the elements of M' from those by M.
    E = np.zeros((9, 9))
    for k in range(3):
        for r in range(3):
            for q in range(3):
                E[3 * k + q, 3 * r + q] = R[k, r]
    s.alignment_score[h] = E.T.copy() @ (s.alignment_score[h] - change)
    s.alignment_information[h] = E.T.copy() @ (s.alignment_information[h] @ E)
    for r in range(c.n):
        for k in range(9):
            s.x[h, r] += d[k] * s.sensitivity[h, k, r]
    s.sensitivity[h] = E.T.copy() @ s.sensitivity[h]
    none, back = np.zeros(3), R.T.copy()
    for i in range(s.nodes.shape[0]):
        node = s.nodes[i]
        if not node.present:
            continue
        for at in (node.i_pos, node.i_vel, -1 if node.levelled else node.i_tilt_bias):
            if at >= 0:
                rotate_block(s, c.n, h, at, none, back)
                s.sensitivity[h, :, at : at + 3] = s.sensitivity[h, :, at : at + 3].copy() @ R
    s.accumulated_correction[h, :] = 0.0


@allocating_kernel
def add_mode_uncertainty(c, s, h):
    """Add the uncertainty of the rotation, with its mode at the identity, to P of hypothesis h."""
    H = np.zeros((3, 3))
    climb_to_mode(s.alignment_information[h], s.alignment_score[h], np.eye(3), H)
    least = least_curvature(H)
    for a in range(3):
        H[a, a] += max(c.candidate_std**-2 - least, 0.0)
    J, cov = np.zeros((3, c.n)), np.zeros((3, 3))
    inverse(H, cov)
    for a in range(3):
        u, v = (a + 1) % 3, (a + 2) % 3
        # M = 1 + [a], and the world is that of M^T.
        J[a] = s.sensitivity[h, 3 * v + u] - s.sensitivity[h, 3 * u + v]
        for i in range(s.nodes.shape[0]):
            node = s.nodes[i]
            if node.present:
                for at in (node.i_pos, node.i_vel, -1 if node.levelled else node.i_tilt_bias):
                    if at >= 0:
                        J[a, at + u] += s.x[h, at + v]
                        J[a, at + v] -= s.x[h, at + u]
    s.P[h] += J.T.copy() @ (cov @ J)
