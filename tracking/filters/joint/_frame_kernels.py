"""Which frames are followed while it is open how a group in space is turned.

At first one filter stands for all turns (`_open_kernels`), and its frame is turned to the likeliest
ten times a second: what is reported is that. But what it learns of headings, and of offsets of
sensors, which turn with the body, is right for its own frame only, and so are its gains, as soon as
either counts. So once each turn that may be is known roughly, a frame of its own is followed for
each, by the likelihood of what comes from there on, and turned to the likeliest turn near it: a
Gaussian sum [1] over turns, whose members have one covariance as far as all is linear: so what
counts between them, until one is left, is how well they fit, not how sure they are. Once all are
known to a few degrees, what is left of the turn becomes a part of P, and none is turned any more.

References:
    [1] Alspach and Sorenson, Nonlinear Bayesian estimation using Gaussian sum approximations, IEEE
        Trans. Automatic Control 17 (1972) 439.
"""

from __future__ import annotations

import math

import numpy as np

from tracking.jit import allocating_kernel
from tracking.filters.joint._alignment_kernels import (
    CANDIDATES,
    CHALLENGED,
    FILTERED,
    LINEAR,
    MODES,
)
from tracking.filters.joint._copy_kernels import copy_hypothesis, turn_part
from tracking.filters.joint._open_kernels import near_turns, note_spread, open_frame
from tracking.filters.joint._peak_kernels import (
    climb,
    curvature,
    find_peaks,
    gain,
    inverse,
    is_near,
    least_curvature,
    turned_by,
)
from tracking.filters.joint._sleep_kernels import TIE

SMALL = 0.02
"""[rad] A frame is not turned by less."""


@allocating_kernel
def doubt_turn(c, s, layout, h):
    """Look for other turns of hypothesis h, the only one; until one is likelier it stays as it is.

    It has a head start, of which a mirror image feels all.
    """
    open_frame(c, s, layout, h)
    for k in range(9):
        s.information[h, k, k] += 0.5 * c.head_start
    note_spread(c, s, h)
    s.group[0].alignment = CHALLENGED


@allocating_kernel
def watch_turns(c, s, layout):
    """Turn frames to the likeliest turns, and go on with one for each once it is time."""
    group, was_alive = s.group[0], s.alive.copy()
    if group.t < group.t_patient - TIE:
        # Nothing counts yet for or against any.
        for h in range(s.alive.shape[0]):
            if was_alive[h]:
                open_frame(c, s, layout, h)
        return
    if group.alignment == CHALLENGED and group.n_alive == 1:
        watch_doubt(c, s, layout)
    elif group.alignment == MODES:
        watch_near(c, s)
    else:
        group.alignment = LINEAR
        watch_all(c, s, layout)


@allocating_kernel
def watch_doubt(c, s, layout):
    """Give up a turn that is doubted once another is clearly likelier; keep it after a while."""
    group, R, H = s.group[0], np.eye(3), np.zeros((3, 3))
    value = climb(s.information[group.best], s.score[group.best], R, H)
    turns, values = likely_turns(c, s, layout, group.best)
    if values[0] > value + c.challenger_lead:
        R[:], value = turns[0], values[0]
    if value < c.challenger_lead or is_near(R, np.eye(3)):
        # One that is near is what these seconds tell; the filter knows it better from before.
        if len(values) == 1 or group.t - group.t_open > c.challenge_longest:
            group.alignment = FILTERED
        return
    group.alignment = MODES
    follow_turns(c, s, group.best, turns, values)


@allocating_kernel
def watch_all(c, s, layout):
    """Turn every frame to the likeliest of all turns; part with them once each is known roughly."""
    was_alive, known, H = s.alive.copy(), True, np.zeros((3, 3))
    for h in range(s.alive.shape[0]):
        if not was_alive[h]:
            continue
        R = np.eye(3)
        value = climb(s.information[h], s.score[h], R, H)
        turns, values = likely_turns(c, s, layout, h)
        if values[0] > value + c.mode_lead:
            R[:] = turns[0]
        for a in range(len(values)):
            climb(s.information[h], s.score[h], turns[a], H)
            known = known and least_curvature(H) > c.mode_std**-2
        turn_frame(c, s, h, R)
        note_spread(c, s, h)
    if not known:
        return
    s.group[0].alignment = MODES
    for h in range(s.alive.shape[0]):
        if was_alive[h]:
            turns, values = likely_turns(c, s, layout, h)
            follow_turns(c, s, h, turns, values)


@allocating_kernel
def likely_turns(c, s, layout, h):
    """The turns of hypothesis h that may be, (turn, 3, 3), and how likely, the likeliest first."""
    turns, values = find_peaks(s.information[h], s.score[h], layout.rotations)
    n = 1
    while n < len(values) and values[n] > values[0] - c.prune:
        n += 1
    return turns[:n], values[:n]


@allocating_kernel
def follow_turns(c, s, h, turns, values):
    """Follow hypothesis h in each of these turns, by so much likelier, while the bank has room."""
    for k in range(len(values)):
        a = (k + 1) % len(values)  # itself last
        target = copy_hypothesis(s, h) if a > 0 else h
        if target >= 0:
            s.loglik[target] += values[a]
            turn_frame(c, s, target, turns[a].copy())
            note_spread(c, s, target)


@allocating_kernel
def watch_near(c, s):
    """Turn every frame to the likeliest turn near it; hypotheses follow once all are known."""
    known = True
    for h in range(s.alive.shape[0]):
        if s.alive[h]:
            known = turn_to_peak(c, s, h) and known
            note_spread(c, s, h)
    if not known:
        return
    s.group[0].alignment = CANDIDATES
    for h in range(s.alive.shape[0]):
        if s.alive[h]:
            spread_frame(c, s, h)


@allocating_kernel
def turn_to_peak(c, s, h):
    """Turn the frame of hypothesis h to the likeliest turn near it; true once that is known."""
    g, w, H, J = np.zeros(9), np.zeros(3), np.zeros((3, 3)), near_turns()
    curvature(s.information[h], np.eye(3), s.score[h], w, H)
    known = least_curvature(H) > c.candidate_std**-2
    # Only about axes of which more is known than which of the frames it is.
    values, axes = np.linalg.eigh(J @ (s.information[h] @ J.T.copy()))
    move = np.zeros(3)
    for a in range(3):
        if values[a] > c.mode_std**-2:
            axis = axes[:, a].copy()
            move += axis * (np.sum(axis * w) / values[a])
    length = math.sqrt(np.sum(move * move))
    R = turned_by(move * min(1.0, c.mode_std / max(length, SMALL)))
    if length > SMALL and gain(s.information[h], s.score[h], R, g) > 0.0:
        turn_frame(c, s, h, R)
    return known


@allocating_kernel
def turn_frame(c, s, h, R):
    """Turn the frame of hypothesis h so that the turn R becomes none."""
    d = np.zeros(9)
    for k in range(9):
        d[k] = R[k // 3, k % 3] - (1.0 if k % 4 == 0 else 0.0)
    change = s.information[h] @ d
    # M = R M': derivatives by the elements of the one from those by the other.
    E = np.zeros((9, 9))
    for k in range(3):
        for r in range(3):
            for q in range(3):
                E[3 * k + q, 3 * r + q] = R[k, r]
    s.score[h] = E.T.copy() @ (s.score[h] - change)
    s.information[h] = E.T.copy() @ (s.information[h] @ E)
    for r in range(c.n):
        for k in range(9):
            s.x[h, r] += d[k] * s.slope[h, k, r]
    s.slope[h] = E.T.copy() @ s.slope[h]
    none, back = np.zeros(3), R.T.copy()
    for i in range(s.nodes.shape[0]):
        node = s.nodes[i]
        if not node.present:
            continue
        for at in (node.at_p, node.at_v, -1 if node.levelled else node.at_b):
            if at >= 0:
                turn_part(s, c.n, h, at, none, back)
                s.slope[h, :, at : at + 3] = s.slope[h, :, at : at + 3].copy() @ R
    s.moved[h, :] = 0.0


@allocating_kernel
def spread_frame(c, s, h):
    """Add to P what is not known of the turn, which is the likeliest: none."""
    H = np.zeros((3, 3))
    climb(s.information[h], s.score[h], np.eye(3), H)
    least = least_curvature(H)
    for a in range(3):
        H[a, a] += max(c.candidate_std**-2 - least, 0.0)
    J, cov = np.zeros((3, c.n)), np.zeros((3, 3))
    inverse(H, cov)
    for a in range(3):
        u, v = (a + 1) % 3, (a + 2) % 3
        # M = 1 + [a], and the world is that of M^T.
        J[a] = s.slope[h, 3 * v + u] - s.slope[h, 3 * u + v]
        for i in range(s.nodes.shape[0]):
            node = s.nodes[i]
            if node.present:
                for at in (node.at_p, node.at_v, -1 if node.levelled else node.at_b):
                    if at >= 0:
                        J[a, at + u] += s.x[h, at + v]
                        J[a, at + v] -= s.x[h, at + u]
    s.P[h] += J.T.copy() @ (cov @ J)
