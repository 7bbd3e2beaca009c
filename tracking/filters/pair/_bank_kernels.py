"""The group as a whole: MDS refinement, the bank of hypotheses, and nodes that leave."""

from __future__ import annotations

import numpy as np

from tracking.compiled import kernel, small_kernel
from tracking.filters._shape_kernels import SURVEYED
from tracking.filters.pair._mds_kernels import refine
from tracking.filters.pair._start_kernels import copy_hypothesis, hypothesis_positions


@small_kernel
def refine_group(c, s, layout, scratch):
    """Move the positions of every hypothesis to their MDS refinement.

    Returns:
        True if the reported layout was too flat to tell its mirror image and now is not.
    """
    n = s.nodes.shape[0]
    m = 0
    for i in range(n):
        if s.nodes[i].present:
            scratch.members[m] = i
            m += 1
    opened = False
    if m < 3:
        return opened
    for h in range(s.alive.shape[0]):
        if not s.alive[h]:
            continue
        gather(c, s, layout, scratch, m, h)
        spread = refine(scratch.T, scratch.K, scratch.X, scratch.small, m, c.d)
        if h == s.group[0].best:
            if spread < c.mds_min_spread:
                s.group[0].flat = True
            elif s.group[0].flat and spread > 2.0 * c.mds_min_spread:
                s.group[0].flat = False
                opened = True
        if spread < c.mds_min_spread:
            continue
        for a in range(m):
            for b in range(a + 1, m):
                p = layout.pair_index[scratch.members[a], scratch.members[b]]
                move_to(c, s, p, h, scratch.T, a, b)
    return opened


@small_kernel
def gather(c, s, layout, scratch, m, h):
    """Squared distances, and positions by least squares over all pairs of one hypothesis."""
    for a in range(m):
        scratch.K[a, a] = 0.0
        for k in range(3):
            scratch.T[a, k] = 0.0
    for a in range(m):
        for b in range(a + 1, m):
            p = layout.pair_index[scratch.members[a], scratch.members[b]]
            squared = 0.0
            for k in range(c.d):
                v = s.x[p, h, k]
                squared += v * v
                scratch.T[b, k] += v / m
                scratch.T[a, k] -= v / m
            scratch.K[a, b] = squared
            scratch.K[b, a] = squared


@small_kernel
def move_to(c, s, p, h, T, a, b):
    """Replace the position of a filter; the velocity follows by the filter's covariance.

    With ``G = (P_xx + R)^-1`` the state moves by ``P_xx G nu`` and ``P_vx G nu``. The
    covariance stays as it is: the refined position holds nothing that the filters of the
    group did not know already.
    """
    x, P, d = s.x, s.P, c.d
    y0, y1, y2 = 0.0, 0.0, 0.0
    n0 = T[b, 0] - T[a, 0] - x[p, h, 0]
    n1 = T[b, 1] - T[a, 1] - x[p, h, 1]
    A00, A01, A11 = P[p, h, 0, 0] + c.mds_var, P[p, h, 0, 1], P[p, h, 1, 1] + c.mds_var
    if d == 2:
        inverse = 1.0 / (A00 * A11 - A01 * A01)
        y0, y1 = (A11 * n0 - A01 * n1) * inverse, (A00 * n1 - A01 * n0) * inverse
    else:
        n2 = T[b, 2] - T[a, 2] - x[p, h, 2]
        A02, A12, A22 = P[p, h, 0, 2], P[p, h, 1, 2], P[p, h, 2, 2] + c.mds_var
        c00, c01, c02 = A11 * A22 - A12 * A12, A02 * A12 - A01 * A22, A01 * A12 - A02 * A11
        inverse = 1.0 / (A00 * c00 + A01 * c01 + A02 * c02)
        c11, c12, c22 = A00 * A22 - A02 * A02, A01 * A02 - A00 * A12, A00 * A11 - A01 * A01
        y0 = (c00 * n0 + c01 * n1 + c02 * n2) * inverse
        y1 = (c01 * n0 + c11 * n1 + c12 * n2) * inverse
        y2 = (c02 * n0 + c12 * n1 + c22 * n2) * inverse
    for k in range(6):
        x[p, h, k] += P[p, h, k, 0] * y0 + P[p, h, k, 1] * y1 + P[p, h, k, 2] * y2


@kernel
def add_mirror_image(c, s, layout):
    """Make the mirror image of the reported hypothesis one, if the bank has room.

    It is mirrored across the line or plane that the layout is nearest to.
    """
    h = s.group[0].best
    target = copy_hypothesis(s, h)
    if target < 0:
        return
    pos = np.zeros((s.nodes.shape[0], 3))
    hypothesis_positions(s, layout, h, pos)
    flat = pos[:, : c.d].copy()
    _, E = np.linalg.eigh(flat.T.copy() @ flat)
    M = np.zeros((6, 6))
    for r in range(3):
        M[r, r] = M[3 + r, 3 + r] = 1.0
    for r in range(c.d):
        for k in range(c.d):
            M[r, k] -= 2.0 * E[r, 0] * E[k, 0]
            M[3 + r, 3 + k] -= 2.0 * E[r, 0] * E[k, 0]
    for p in range(s.pairs.shape[0]):
        s.x[p, target] = M @ s.x[p, h].copy()
        s.P[p, target] = M @ s.P[p, h].copy() @ M.T.copy()


@kernel
def prune_bank(c, s):
    """Drop hypotheses that are unlikely or the same as a better one; choose the best."""
    group = s.group[0]
    if group.n_alive < 2:
        return
    n_hyps = s.alive.shape[0]
    best = -1
    for h in range(n_hyps):
        if s.alive[h] and (best < 0 or s.loglik[h] > s.loglik[best]):
            best = h
    # The report changes only for a clear gain, or equal hypotheses would take turns.
    if not s.alive[group.best] or s.loglik[best] > s.loglik[group.best] + 2.0:
        group.best = best
    top = s.loglik[best]
    for h in range(n_hyps):
        if s.alive[h] and h != group.best and s.loglik[h] < top - c.prune:
            s.alive[h] = False
    for a in range(n_hyps):
        for b in range(n_hyps):
            if (
                a != b
                and s.alive[a]
                and s.alive[b]
                and b != group.best
                and (s.loglik[a] >= s.loglik[b] or a == group.best)
                and are_same(c, s, a, b)
            ):
                s.alive[b] = False
    group.n_alive = np.sum(s.alive)


@kernel
def are_same(c, s, a, b):
    """True when two hypotheses agree in position and velocity of every pair.

    Velocities count over one second: a layout and its mirror image may meet in a line, but
    they go on to different sides.
    """
    for p in range(s.pairs.shape[0]):
        if s.nodes[s.pairs[p].i].present and s.nodes[s.pairs[p].j].present:
            squared = 0.0
            for k in range(6):
                squared += (s.x[p, a, k] - s.x[p, b, k]) ** 2
            if squared > c.merge_distance**2:
                return False
    return True


@kernel
def remove_node(s, layout, i):
    """Destroy the filters of a node that left."""
    s.nodes[i].present = False
    s.nodes[i].heard = False
    n_present = 0
    for k in range(s.nodes.shape[0]):
        n_present += s.nodes[k].present
        if k != i:
            pair = s.pairs[layout.pair_index[i, k]]
            pair.n_ranges = 0
            if pair.start_n < SURVEYED:
                pair.start_n = 0
    if n_present < 2:
        for k in range(s.nodes.shape[0]):
            s.nodes[k].present = False
        s.alive[:] = False
        s.group[0].n_alive = 0
        s.group[0].started = False


@kernel
def remove_silent(c, s, layout, t):
    """Remove the nodes that were not heard for so long that they must have left."""
    for i in range(s.nodes.shape[0]):
        if s.nodes[i].present and t - s.nodes[i].t_heard > c.leave_after:
            remove_node(s, layout, i)
