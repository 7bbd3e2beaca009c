"""A group in space of which nothing tells yet how it is turned: all turns at once, linearly.

Ranges give the layout of a group in some frame, which is the world's turned or mirrored by an
orthogonal matrix M. What is measured in the world, accelerations first of all, enters that
frame as ``M a``: linear in the nine elements of M. So with M known, what the filter does is
linear in M as well, as far as it is linear at all: its states are ``x + sum_k slope_k (M - 1)_k``,
its gains do not depend on M, and innovations are ``nu + g . (M - 1)``. One filter thus gives the
likelihood of every M, which is Gaussian in its elements,

    log L(M) = score . (M - 1) - (M - 1) . information (M - 1) / 2,

among them all rotations and mirror images, which `_peak_kernels` looks through. The frame is
turned time and again so that the likeliest is M = 1: what is reported is the likeliest turn.
It is the estimate of a constant by the sensitivities of a Kalman filter to it [1], and to look
for a rotation among all matrices first is an old way to find one without a first guess [2].

Once only turns are left each of which is known to a few degrees, they become hypotheses.

References:
    [1] Friedland, Treatment of bias in recursive filtering, IEEE Trans. Automatic Control 14
        (1969) 359.
    [2] Wahba, A least squares estimate of satellite attitude, SIAM Review 7 (1965) 409.
"""

from __future__ import annotations

import numpy as np

from tracking.compiled import allocating_kernel, kernel, small_kernel
from tracking.filters.joint._antenna_kernels import turn_with_world
from tracking.filters.joint._copy_kernels import copy_hypothesis, turn_part
from tracking.filters.joint._gyroscope_kernels import STEP, lean_slope
from tracking.filters.joint._motion_kernels import moves, states_behind
from tracking.filters.joint._peak_kernels import (
    climb,
    find_peaks,
    inverse,
    is_near,
    least_curvature,
)
from tracking.filters.joint._step_kernels import STATES

LOOSE = 3.0
"""[-] Each element of M has a variance of a third, over all rotations."""
TIE = 1e-6
"""[s] Times that differ by less are equal, whatever the clock began with."""
CLEAR, CLEARER = 1.0, 5.0
"""[-] By so much another turn has to be likelier (log-likelihood) before it is reported; where one
was known and is doubted by more: noise that lasts makes some other look a little likelier."""
KNOWN = 0.2
"""[rad] Turns that are known so well are left to filters that are linear about each of them."""
LONG = 20.0
"""[s] After so long without a likelier turn it is kept."""


@small_kernel
def can_open(c, s):
    """True for groups in space of more than three nodes: too little holds a layout of three.

    Those that start are few at first, the others join at once. A smoother, which has no slopes,
    takes the turn as it is.
    """
    return s.slope.shape[1] > 0 and s.nodes.shape[0] > c.d


@allocating_kernel
def open_frame(c, s, layout, h):
    """Take back what is known of the turn of hypothesis h, nothing of which waits.

    But that fixed nodes differ less in height than in width, where people put them.
    """
    s.score[h], s.information[h] = 0.0, 0.0
    turn_with_world(s, layout, h)
    mean, m = np.zeros(3), 0
    for i in range(s.nodes.shape[0]):
        if s.nodes[i].present and s.nodes[i].static:
            mean += s.x[h, s.nodes[i].at_p : s.nodes[i].at_p + 3]
            m += 1
    mean /= max(m, 1)
    for i in range(s.nodes.shape[0]):
        if s.nodes[i].present and s.nodes[i].static:
            out = s.x[h, s.nodes[i].at_p : s.nodes[i].at_p + 3] - mean
            for r in range(3):
                s.score[h, 3 * r + 2] -= out[r] * out[2] / c.height_var
                for q in range(3):
                    s.information[h, 3 * r + 2, 3 * q + 2] += out[r] * out[q] / c.height_var
    note_spread(s, h)
    s.group[0].open, s.group[0].held, s.group[0].t_open = True, False, s.group[0].t


@allocating_kernel
def note_spread(s, h):
    """Work out how uncertain the elements of the turn are."""
    s.spread[h] = np.linalg.inv(s.information[h] + LOOSE * np.eye(9))


@kernel
def carry_slope(c, s, h, scratch):
    """Carry the slopes over the step that `predict` has just made, and from which `scratch` is."""
    first, last = c.n_motion, c.n
    for k in range(9):
        row, column = k // 3, k % 3
        z = s.slope[h, k]
        for i in range(s.nodes.shape[0]):
            node = s.nodes[i]
            if not moves(node):
                continue
            p, v, b, w, F = node.at_p, node.at_v, node.at_b, scratch.step[i], scratch.derivatives[i]
            for r in range(6):
                z[p + r] += F[STATES, r] * z[p + 3 + r] if r < 3 else 0.0
                for q in range(states_behind(node)):
                    z[p + r] += F[q, r] * z[b + q]
            if node.told:
                lean_slope(node, z, w)
                z[b + row] += (w[STEP], w[STEP + 1], 0.0)[column]
            # A turn by the heading error is one of M as well.
            z[p + row] += (w[6], -w[5], w[28])[column]
            z[v + row] += (w[8], -w[7], w[27])[column]
        for r in range(first, last):
            z[r] *= scratch.scale[r]


@small_kernel
def turn_gradient(s, h, m, scratch):
    """Write the derivatives of an innovation by the turn; returns the variance they add.

    Args:
        s: JointState of one environment, open.
        h: Hypothesis.
        m: Number of derivatives by states.
        scratch: Room; `idx` and `val` hold states and derivatives of what is predicted, `direct`
            its derivatives by the turn with the states held; `gradient` is written.
    """
    g = scratch.gradient
    for k in range(9):
        g[k] = -scratch.direct[k]
        for a in range(m):
            g[k] -= scratch.val[a] * s.slope[h, k, scratch.idx[a]]
    variance = 0.0
    for k in range(9):
        for q in range(9):
            variance += g[k] * s.spread[h, k, q] * g[q]
    return variance


@small_kernel
def tell_turn(s, h, scratch, nu, S):
    """Let an innovation of variance S, about to be absorbed, tell of the turn.

    Args:
        s: JointState of one environment, open.
        h: Hypothesis.
        scratch: `w` is ``P H``, `gradient` as of `turn_gradient`.
        nu: The innovation.
        S: Its variance, the turn known.
    """
    g, w = scratch.gradient, scratch.w
    for k in range(9):
        share = g[k] / S
        s.score[h, k] -= share * nu
        for q in range(9):
            s.information[h, k, q] += share * g[q]
        for r in range(s.slope.shape[2]):
            s.slope[h, k, r] += w[r] * share


@allocating_kernel
def doubt_turn(c, s, layout, h):
    """Look for other turns of hypothesis h, the only one; until one is likelier it stays as it is.

    It has a head start, of which a mirror image feels all.
    """
    open_frame(c, s, layout, h)
    for k in range(9):
        s.information[h, k, k] += 0.5 * c.head_start
    note_spread(s, h)
    s.group[0].held = True


@allocating_kernel
def watch_turns(c, s, layout):
    """Turn the frames so that the likeliest turn is none; go on with hypotheses once it is time."""
    group, was_alive = s.group[0], s.alive.copy()
    if group.t < group.t_patient - TIE:
        # Nothing counts yet for or against any.
        for h in range(s.alive.shape[0]):
            if was_alive[h]:
                open_frame(c, s, layout, h)
        return
    if group.held and group.n_alive > 1:
        group.held = False
    known, H = True, np.zeros((3, 3))
    for h in range(s.alive.shape[0]):
        if not was_alive[h]:
            continue
        R = np.eye(3)
        value = climb(s.information[h], s.score[h], R, H)
        turns, values = find_peaks(s.information[h], s.score[h], layout.rotations)
        clear = CLEARER if group.held else CLEAR
        if values[0] > value + clear:
            R[:], value = turns[0], values[0]
        if group.held:
            # One that is near is what these seconds tell; the filter knows it better from before.
            if value < CLEARER or is_near(R, np.eye(3)):
                rivals = len(values) > 1 and values[1] > values[0] - c.prune
                if not rivals or group.t - group.t_open > LONG:
                    group.open = False
                return
            group.held = False
        for a in range(len(values)):
            if values[a] > values[0] - c.prune:
                climb(s.information[h], s.score[h], turns[a], H)
                known = known and least_curvature(H) > KNOWN**-2
        turn_frame(c, s, h, R)
        note_spread(s, h)
    if known:
        close_frames(c, s, layout)


@allocating_kernel
def turn_frame(c, s, h, R):
    """Turn the frame of hypothesis h so that the turn R becomes none."""
    d = np.zeros(9)
    for k in range(9):
        d[k] = R[k // 3, k % 3] - (1.0 if k % 4 == 0 else 0.0)
    change = s.information[h] @ d
    s.loglik[h] += np.sum(d * s.score[h]) - 0.5 * np.sum(d * change)
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
def close_frames(c, s, layout):
    """Make a hypothesis of every turn that may be, the likeliest of each layout first."""
    s.group[0].open = False
    was_alive = s.alive.copy()
    for h in range(s.alive.shape[0]):
        if not was_alive[h]:
            continue
        turns, values = find_peaks(s.information[h], s.score[h], layout.rotations)
        for a in range(len(values) - 1, -1, -1):
            if a > 0 and values[a] < values[0] - c.prune:
                continue
            target = copy_hypothesis(s, h) if a > 0 else h
            if target >= 0:
                turn_frame(c, s, target, turns[a])
                spread_frame(c, s, target)


@allocating_kernel
def spread_frame(c, s, h):
    """Add to P what is not known of the turn, which is the likeliest: none."""
    H = np.zeros((3, 3))
    climb(s.information[h], s.score[h], np.eye(3), H)
    least = least_curvature(H)
    for a in range(3):
        H[a, a] += max(KNOWN**-2 - least, 0.0)
    J, cov = np.zeros((3, c.n)), np.zeros((3, 3))
    s.loglik[h] += 0.5 * np.log(inverse(H, cov))
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
