"""The group as a whole: MDS refinement, the bank of hypotheses, and nodes that leave."""

from __future__ import annotations

import numpy as np
from tracking.compiled import kernel

from tracking.filters._mds_kernels import refine
from tracking.filters._pair_kernels import correct


@kernel
def refine_group(c, nodes, pairs, bank, e):
    """Correct every hypothesis with the MDS refinement of its positions."""
    n = nodes.present.shape[1]
    members = np.empty(n, np.int64)
    m = 0
    for i in range(n):
        if nodes.present[e, i]:
            members[m] = i
            m += 1
    if m < 3:
        return
    pos, X = np.zeros((m, m, 3)), np.empty((m, 3))
    for h in range(bank.alive.shape[1]):
        if not bank.alive[e, h]:
            continue
        for a in range(m):
            for b in range(a + 1, m):
                x = pairs.x[e, h, c.pair_index[members[a], members[b]]]
                for k in range(3):
                    pos[a, b, k] = x[k]
                    pos[b, a, k] = -x[k]
        spread = refine(pos, c.d, X)
        if h == bank.best[e]:
            watch_flat(c, nodes, pairs, bank, e, h, X, spread)
        if spread < c.mds_min_spread:
            continue
        for a in range(m):
            for b in range(a + 1, m):
                p = c.pair_index[members[a], members[b]]
                move_to(c, pairs.x[e, h, p], pairs.P[e, h, p], X[b] - X[a])


@kernel
def move_to(c, x, P, pos):
    """Replace the position of a filter; the velocity follows by the filter's covariance.

    The covariance stays as it is: the refined position holds nothing that the filters of the
    group did not know already.
    """
    H, scratch = np.zeros(6), P.copy()
    for k in range(c.d):
        H[k] = 1.0
        correct(x, scratch, H, pos[k] - x[k], c.mds_var, c.d)
        H[k] = 0.0


@kernel
def watch_flat(c, nodes, pairs, bank, e, h, X, spread):
    """A layout that was flat and opens again may be its mirror image: make that a hypothesis."""
    if spread < c.mds_min_spread:
        bank.flat[e] = True
    elif bank.flat[e] and spread > 2.0 * c.mds_min_spread:
        bank.flat[e] = False
        for target in range(bank.alive.shape[1]):
            if not bank.alive[e, target]:
                mirror_hypothesis(c, pairs, bank, e, h, target, X)
                break


@kernel
def mirror_hypothesis(c, pairs, bank, e, h, target, X):
    """Copy a hypothesis, mirrored across the line or plane that its layout X is nearest to."""
    layout = np.ascontiguousarray(X[:, : c.d])
    _, E = np.linalg.eigh(layout.T @ layout)
    M = np.zeros((6, 6))
    for r in range(3):
        M[r, r] = M[3 + r, 3 + r] = 1.0
    for r in range(c.d):
        for k in range(c.d):
            M[r, k] -= 2.0 * E[r, 0] * E[k, 0]
            M[3 + r, 3 + k] -= 2.0 * E[r, 0] * E[k, 0]
    for p in range(c.pairs.shape[0]):
        pairs.x[e, target, p] = M @ np.ascontiguousarray(pairs.x[e, h, p])
        pairs.P[e, target, p] = M @ np.ascontiguousarray(pairs.P[e, h, p]) @ M.T
    bank.alive[e, target] = True
    bank.loglik[e, target] = bank.loglik[e, h]


@kernel
def prune_bank(c, nodes, pairs, bank, e):
    """Drop hypotheses that are unlikely or the same as a better one; choose the best."""
    n_hyps = bank.alive.shape[1]
    best = -1
    for h in range(n_hyps):
        if bank.alive[e, h] and (best < 0 or bank.loglik[e, h] > bank.loglik[e, best]):
            best = h
    if best < 0:
        return
    reported = bank.best[e]
    # The report changes only for a clear gain, or equal hypotheses would take turns.
    if not bank.alive[e, reported] or bank.loglik[e, best] > bank.loglik[e, reported] + 2.0:
        bank.best[e] = best
    top = bank.loglik[e, best]
    for h in range(n_hyps):
        if bank.alive[e, h] and h != bank.best[e] and bank.loglik[e, h] < top - c.prune:
            bank.alive[e, h] = False
    for a in range(n_hyps):
        for b in range(n_hyps):
            if (
                a != b
                and bank.alive[e, a]
                and bank.alive[e, b]
                and b != bank.best[e]
                and (bank.loglik[e, a] >= bank.loglik[e, b] or a == bank.best[e])
                and are_same(c, nodes, pairs, e, a, b)
            ):
                bank.alive[e, b] = False


@kernel
def are_same(c, nodes, pairs, e, a, b):
    """True when two hypotheses agree in the position of every pair."""
    for p in range(c.pairs.shape[0]):
        if nodes.present[e, c.pairs[p, 0]] and nodes.present[e, c.pairs[p, 1]]:
            s = 0.0
            for k in range(3):
                s += (pairs.x[e, a, p, k] - pairs.x[e, b, p, k]) ** 2
            if s > c.merge_distance**2:
                return False
    return True


@kernel
def remove_node(c, nodes, pairs, bank, e, i):
    """Destroy the filters of a node that left."""
    nodes.present[e, i] = False
    nodes.heard[e, i] = False
    for k in range(nodes.present.shape[1]):
        if k != i:
            p = c.pair_index[i, k]
            pairs.start_n[e, p] = 0
            pairs.n_ranges[e, p] = 0
    if np.sum(nodes.present[e]) < 2:
        nodes.present[e, :] = False
        bank.alive[e, :] = False


@kernel
def remove_silent(c, nodes, pairs, bank, e, t):
    """Remove the nodes that were not heard for so long that they must have left."""
    for i in range(nodes.present.shape[1]):
        if nodes.present[e, i] and t - nodes.t_heard[e, i] > c.leave_after:
            remove_node(c, nodes, pairs, bank, e, i)
