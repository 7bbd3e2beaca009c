"""The group as a whole: MDS refinement, the bank of hypotheses, and nodes that leave."""

from __future__ import annotations

import numpy as np

from tracking.filters.best_hypothesis import choose_best
from tracking.filters.first_ranges import forget_first
from tracking.filters.pair.initialisation import (
    copy_hypothesis,
    forget_mean,
    hypothesis_positions,
)
from tracking.filters.pair.mds_feedback import add_pair, factor, move_pair, solve, weigh
from tracking.kernels.jit import allocating_kernel, kernel, small_kernel


@small_kernel
def refine_group(c, s, layout, work):
    """Set every hypothesis to its weighted MDS: positions, velocities and range errors."""
    n, size = s.nodes.shape[0], 2 * c.d
    m = 0
    for i in range(n):
        if s.nodes[i].present:
            work.members[m] = i
            m += 1
    if m < 3:
        return
    rows = (m - 1) * size
    W, A, y = work.W, work.A, work.y
    for h in range(s.alive.shape[0]):
        if not s.alive[h]:
            continue
        for r in range(rows):
            y[r] = 0.0
            for k in range(r + 1):
                A[r, k] = 0.0
        for a in range(m):
            for b in range(a + 1, m):
                p = layout.pair_index[work.members[a], work.members[b]]
                weigh(s.P, p, h, c.d, work.L, W)
                add_pair(s.x, p, h, c.d, W, a, b, A, y)
        factor(A, rows)
        solve(A, y, rows)
        for a in range(m):
            for b in range(a + 1, m):
                p = layout.pair_index[work.members[a], work.members[b]]
                move_pair(s.x, s.P, p, h, c.d, W, a, b, y, work.nu)


@allocating_kernel
def degeneracy_ratio(c, s, layout):
    """Return the least extent of the reported layout over its standard deviation [-]."""
    h, d, n = s.group[0].best, c.d, s.nodes.shape[0]
    pos = np.zeros((n, 3))
    hypothesis_positions(s, layout, h, pos)
    present, n_pairs = 0, 0
    for i in range(n):
        present += s.nodes[i].present
        if not s.nodes[i].present:
            pos[i] = 0.0
    if present <= d:
        return np.inf
    flat = pos[:, :d].copy()
    eigenvalues, E = np.linalg.eigh(flat.T.copy() @ flat)
    # Variance along the shortest axis: each end has half of a pair's. Certain pairs count most.
    information = 0.0
    for p in range(s.pairs.shape[0]):
        if s.nodes[s.pairs[p].i].present and s.nodes[s.pairs[p].j].present:
            n_pairs += 1
            across = 0.0
            for k in range(d):
                for q in range(d):
                    across += E[k, 0] * E[q, 0] * s.P[p, h, k, q]
            information += 1.0 / max(across, 1e-9)
    variance = 0.5 * present * n_pairs / information
    return np.sqrt(max(eigenvalues[0], 0.0) / max(variance, 1e-12))


@kernel
def monitor_reflection(c, s, layout):
    """Add the mirror image of a layout that was degenerate or fits its ranges badly."""
    group = s.group[0]
    if group.n_alive != 1:
        return
    ratio = degeneracy_ratio(c, s, layout)
    if ratio < c.degenerate:
        group.flat = True
    elif group.flat and ratio > c.regular:
        group.flat = False
        add_mirror_image(c, s, layout)
    elif group.misfit > c.reflection_nis and ratio > c.regular and ratio < np.inf:
        group.misfit = 1.0
        add_mirror_image(c, s, layout)


@allocating_kernel
def add_mirror_image(c, s, layout):
    """Add the mirror image of the reported hypothesis to the bank, if it has room.

    The layout is reflected across the line or plane that fits it best.
    """
    h = s.group[0].best
    target = copy_hypothesis(s, h)
    if target < 0:
        return
    pos = np.zeros((s.nodes.shape[0], 3))
    hypothesis_positions(s, layout, h, pos)
    flat = pos[:, : c.d].copy()
    _, E = np.linalg.eigh(flat.T.copy() @ flat)
    M = np.eye(s.x.shape[2])
    for r in range(c.d):
        for k in range(c.d):
            M[r, k] -= 2.0 * E[r, 0] * E[k, 0]
            M[3 + r, 3 + k] -= 2.0 * E[r, 0] * E[k, 0]
    for p in range(s.pairs.shape[0]):
        s.x[p, target] = M @ s.x[p, h].copy()
        s.P[p, target] = M @ s.P[p, h].copy() @ M.T.copy()


@allocating_kernel
def prune_bank(c, s):
    """Drop hypotheses that are unlikely or the same as a better one; choose the best."""
    group = s.group[0]
    if group.n_alive < 2:
        return
    n_hyps = s.alive.shape[0]
    best, _ = choose_best(s, c.report_lead)
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
    for h in range(n_hyps):
        s.loglik[h] -= top


@kernel
def are_same(c, s, a, b):
    """True if two hypotheses agree in position and velocity of every pair.

    Velocities count over one second: a layout and its mirror image may coincide in a line, but
    their velocities differ.
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
def remove_node(c, s, layout, i, t):
    """Destroy the filters of a node that left."""
    s.nodes[i].present = False
    s.nodes[i].seen = False
    s.group[0].flat = False
    forget_mean(c, s, t)
    n_present = 0
    for k in range(s.nodes.shape[0]):
        n_present += s.nodes[k].present
        if k != i:
            pair = s.pairs[layout.pair_index[i, k]]
            pair.n_ranges = 0
            forget_first(pair)
    if n_present < 2:
        for k in range(s.nodes.shape[0]):
            s.nodes[k].present, s.nodes[k].seen = False, False
        s.alive[:] = False
        s.group[0].n_alive = 0
        s.group[0].started = False


@kernel
def drop_timed_out(c, s, layout, t):
    """Remove the nodes whose last range is older than `node_timeout`."""
    for i in range(s.nodes.shape[0]):
        if (s.nodes[i].present or s.nodes[i].seen) and t - s.nodes[i].t_last_range > c.node_timeout:
            remove_node(c, s, layout, i, t)
