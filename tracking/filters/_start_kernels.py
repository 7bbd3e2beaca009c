"""Starting a group and joining it: from the first k ranges of each pair to running filters.

A group starts with MDS on the mean of the first k ranges, once for every rotation and mirror
image of the bank. A node that joins is placed by least squares on its distances to the nodes
that run already, in every hypothesis; where those are too few or too flat to tell on which
side it is, both sides become hypotheses. Velocities start at zero and P at the identity.
"""

from __future__ import annotations

import numpy as np
from tracking.compiled import kernel


@kernel
def collect(c, pairs, e, p, t, distance, weight):
    """Add one of the first ranges of a pair; a survey counts as all k of them."""
    if pairs.start_n[e, p] > 0 and t - pairs.start_t[e, p] > c.start_max_age:
        if weight == 1 and pairs.start_n[e, p] < 1_000_000:
            pairs.start_n[e, p] = 0
    if weight > 1:
        pairs.start_sum[e, p] = distance * 1_000_000
        pairs.start_n[e, p] = 1_000_000
        pairs.start_t[e, p] = t
    elif pairs.start_n[e, p] < 1_000_000:
        if pairs.start_n[e, p] == 0:
            pairs.start_sum[e, p] = 0.0
            pairs.start_t[e, p] = t
        pairs.start_sum[e, p] += distance
        pairs.start_n[e, p] += 1


@kernel
def is_ready(c, pairs, e, i, j):
    """True when a pair has its first k ranges."""
    return pairs.start_n[e, c.pair_index[i, j]] >= c.start_k


@kernel
def start_distance(c, pairs, e, i, j):
    """Mean of the first ranges of a pair [m]."""
    p = c.pair_index[i, j]
    return pairs.start_sum[e, p] / pairs.start_n[e, p]


@kernel
def begin_pair(c, pairs, e, h, p, pos, t):
    """Put a new filter at a relative position: v = 0, P = 1."""
    x, P = pairs.x[e, h, p], pairs.P[e, h, p]
    x[:] = 0.0
    P[:] = 0.0
    both_static = c.is_static[c.pairs[p, 0]] and c.is_static[c.pairs[p, 1]]
    for k in range(c.d):
        x[k] = pos[k]
        P[k, k] = 1.0
        P[3 + k, 3 + k] = 0.0 if both_static else 1.0
    pairs.t[e, p] = t
    pairs.t_range[e, p] = t
    pairs.n_ranges[e, p] = 0
    pairs.in_a_row[e, p] = 0
    pairs.rate[e, p] = 0.0


@kernel
def try_start(c, nodes, pairs, bank, e, t):
    """Start the group with the nodes whose pairs are all ready; True if it did."""
    n = nodes.present.shape[1]
    members = np.empty(n, np.int64)
    m = 0
    for first in range(n):
        m = 0
        members[0] = first
        m = 1
        for k in range(n):
            fits = k != first
            for a in range(m):
                if fits and (members[a] == k or not is_ready(c, pairs, e, members[a], k)):
                    fits = False
            if fits:
                members[m] = k
                m += 1
        if m >= min(3, n):
            break
    if m < min(3, n):
        return False
    D2 = np.zeros((m, m))
    for a in range(m):
        for b in range(m):
            if a != b:
                D2[a, b] = start_distance(c, pairs, e, members[a], members[b]) ** 2
    J = np.eye(m) - 1.0 / m
    eigenvalues, E = np.linalg.eigh(-0.5 * J @ D2 @ J)
    X = np.zeros((m, 3))
    for k in range(min(c.d, m)):
        X[:, k] = E[:, m - 1 - k] * np.sqrt(max(eigenvalues[m - 1 - k], 0.0))
    for a in range(m):
        nodes.present[e, members[a]] = True
    for h in range(c.rotations.shape[0]):
        bank.alive[e, h] = True
        bank.loglik[e, h] = 0.0
        Y = X @ np.ascontiguousarray(c.rotations[h].T)
        for a in range(m):
            for b in range(m):
                i, j = members[a], members[b]
                if i < j:
                    begin_pair(c, pairs, e, h, c.pair_index[i, j], Y[b] - Y[a], t)
    bank.best[e] = 0
    bank.t_check[e] = t
    bank.t_mds[e] = t
    return True


@kernel
def hypothesis_positions(c, nodes, pairs, e, h, pos):
    """Positions of the present nodes in one hypothesis, relative to their centre (node, 3)."""
    n = pos.shape[0]
    n_present = 0
    for i in range(n):
        n_present += nodes.present[e, i]
    for j in range(n):
        for k in range(3):
            s = 0.0
            for i in range(n):
                if i != j and nodes.present[e, i] and nodes.present[e, j]:
                    x = pairs.x[e, h, c.pair_index[i, j], k]
                    s += x if i < j else -x
            pos[j, k] = s / n_present


@kernel
def place(c, known, distance, sides):
    """Where a node is, from its distances to known ones; both candidates if a mirror fits too.

    Args:
        c: Coefficients.
        known: Positions, (known, 3) [m].
        distance: Distances to them, (known) [m].
        sides: The candidates, (2, 3), written.

    Returns:
        1 if the known nodes span the space, 2 if they are too flat to tell the side.
    """
    m, d = known.shape[0], c.d
    centre = np.zeros(d)
    for a in range(m):
        centre += known[a, :d] / m
    A = known[:, :d] - centre
    _, S, Vt = np.linalg.svd(np.ascontiguousarray(A.T @ A))
    spanned = 0
    for k in range(d):
        if np.sqrt(S[k] / m) > c.mds_min_spread:
            spanned += 1
    # |p|^2 - 2 a.p + |a|^2 = d^2: its differences from the mean are linear in p.
    b = np.zeros(m)
    for a in range(m):
        b[a] = 0.5 * (np.sum(A[a] * A[a]) - distance[a] ** 2)
    b -= np.mean(b)
    p = np.zeros(d)
    for k in range(spanned):
        p += Vt[k] * (np.sum((A @ Vt[k]) * b) / S[k])
    sides[:, :] = 0.0
    height2 = 0.0
    for a in range(m):
        height2 += (distance[a] ** 2 - np.sum((p - A[a]) ** 2)) / m
    height = np.sqrt(max(height2, 0.0)) if spanned < d else 0.0
    for side in range(2):
        up = height if side == 0 else -height
        for k in range(d):
            sides[side, k] = centre[k] + p[k]
            if spanned < d:
                sides[side, k] += up * Vt[spanned, k]
    return 1 if spanned == d or height < c.merge_distance else 2


@kernel
def try_join(c, nodes, pairs, bank, e, new, t):
    """Take a node in once it is ready with enough of the others; True if it joined."""
    n = nodes.present.shape[1]
    n_present, n_ready = 0, 0
    ready = np.empty(n, np.int64)
    for k in range(n):
        if nodes.present[e, k]:
            n_present += 1
            if is_ready(c, pairs, e, new, k):
                ready[n_ready] = k
                n_ready += 1
    if n_ready < min(c.d + 1, n_present):
        return False
    pos, sides = np.zeros((n, 3)), np.empty((2, 3))
    known, distance = np.empty((n_ready, 3)), np.empty(n_ready)
    n_hyps = bank.alive.shape[1]
    was_alive = bank.alive[e].copy()
    for h in range(n_hyps):
        if not was_alive[h]:
            continue
        hypothesis_positions(c, nodes, pairs, e, h, pos)
        for a in range(n_ready):
            known[a] = pos[ready[a]]
            distance[a] = start_distance(c, pairs, e, new, ready[a])
        n_sides = place(c, known, distance, sides)
        for side in range(n_sides):
            target = h
            if side == 1:
                target = -1
                for free in range(n_hyps):
                    if not bank.alive[e, free] and target < 0:
                        target = free
                if target < 0:
                    break
                bank.alive[e, target] = True
                bank.loglik[e, target] = bank.loglik[e, h]
                pairs.x[e, target] = pairs.x[e, h]
                pairs.P[e, target] = pairs.P[e, h]
            for k in range(n):
                if nodes.present[e, k]:
                    sign = 1.0 if k < new else -1.0
                    begin_pair(
                        c,
                        pairs,
                        e,
                        target,
                        c.pair_index[k, new],
                        sign * (sides[side] - pos[k]),
                        t,
                    )
    nodes.present[e, new] = True
    return True
