"""MDS over a group, its alignment, and the nodes that join and leave it."""

from __future__ import annotations

import math

import numpy as np

from tracking.filters.first_ranges import classical_mds
from tracking.filters.paper.pair_filter import POS, VEL, correct_position, predict
from tracking.geometry import FLAT
from tracking.kernels.jit import allocating_kernel, kernel

REPLACE, NONE = 0, 2
"""Values of `feedback`."""


@allocating_kernel
def align(X, target, rows, d):
    """Rotate, reflect and shift X so that the compared rows are nearest to those of the target.

    The solution is that of the orthogonal Procrustes problem, by singular value decomposition.

    Args:
        X: Positions, (node, 3), written.
        target: Positions, (node, 3).
        rows: True for rows that are compared, (node).
        d: 2 or 3.
    """
    mean_x, mean, m = np.zeros(3), np.zeros(3), 0
    for a in range(len(rows)):
        if rows[a]:
            mean_x += X[a]
            mean += target[a]
            m += 1
    mean_x, mean = mean_x / m, mean / m
    C = np.zeros((d, d))
    for a in range(len(rows)):
        if rows[a]:
            for r in range(d):
                for k in range(d):
                    C[r, k] += (X[a, r] - mean_x[r]) * (target[a, k] - mean[k])
    U, size, V = np.linalg.svd(C)
    if size[d - 1] <= FLAT * size[0] and np.linalg.det(U) * np.linalg.det(V) < 0.0:
        U[:, d - 1] *= -1.0  # a line is its own mirror image
    M = U @ V
    for a in range(len(rows)):
        off = X[a] - mean_x
        for k in range(d):
            X[a, k] = mean[k]
            for r in range(d):
                X[a, k] += off[r] * M[r, k]


@allocating_kernel
def filter_positions(s, layout, members, m):
    """Return the positions of members about their centre by the filters' x_ij, (member, 3) [m]."""
    pos, present = np.zeros((m, 3)), 0
    for a in range(m):
        present += s.nodes[members[a]].present
        for b in range(m):
            i, j = members[a], members[b]
            if a != b and s.nodes[i].present and s.nodes[j].present:
                p = layout.pair_index[i, j]
                pos[b] += s.x[p, 0, :3] if i < j else -s.x[p, 0, :3]
    return pos / max(present, 1)


@kernel
def has_first(c, pair):
    """True if a pair without filter has its first k ranges, or a surveyed distance."""
    return pair.surveyed > 0.0 or pair.first_n >= c.k


@kernel
def can_join(c, s, layout, new):
    """True if a node has the first ranges of its pairs with all present nodes."""
    for i in range(s.nodes.shape[0]):
        is_other = i != new and s.nodes[i].present
        if is_other and not has_first(c, s.pairs[layout.pair_index[i, new]]):
            return False
    return True


@allocating_kernel
def first_members(c, s, layout):
    """Return the first three nodes, or both of two, whose pairs have first ranges, or none."""
    n = s.nodes.shape[0]
    for i in range(n):
        for j in range(i + 1, n):
            if not has_first(c, s.pairs[layout.pair_index[i, j]]):
                continue
            if n == 2:
                return np.array([i, j])
            for k in range(j + 1, n):
                if has_first(c, s.pairs[layout.pair_index[i, k]]) and has_first(
                    c, s.pairs[layout.pair_index[j, k]]
                ):
                    return np.array([i, j, k])
    return np.zeros(0, np.int64)


@allocating_kernel
def initialise(c, s, layout, t):
    """Spawn the filters of new nodes from MDS on the first k measurements."""
    n, present = s.nodes.shape[0], 0
    for i in range(n):
        present += s.nodes[i].present
    if present == 0:
        first = first_members(c, s, layout)
        if len(first) == 0:
            return
        spawn(c, s, layout, first, t)
    again = True
    while again:
        again = False
        for new in range(n):
            if not s.nodes[new].present and can_join(c, s, layout, new):
                spawn(c, s, layout, np.array([new]), t)
                again = True
                break


@allocating_kernel
def spawn(c, s, layout, new, t):
    """Place new nodes by MDS over the group and start the filters of their pairs."""
    n = s.nodes.shape[0]
    members, m, present = np.zeros(n, np.int64), 0, 0
    for i in range(n):
        present += s.nodes[i].present
        if s.nodes[i].present or np.any(new == i):
            members[m] = i
            m += 1
    D, known = np.zeros((m, m)), np.zeros(m, np.bool_)
    for a in range(m):
        known[a] = s.nodes[members[a]].present or present == 0
        for b in range(a + 1, m):
            D[a, b] = distance_between(c, s, layout, members[a], members[b], t)
            D[b, a] = D[a, b]
    X = classical_mds(D * D, c.d, c.power)
    if present > 0:
        align(X, filter_positions(s, layout, members, m), known, c.d)
    elif c.has_layout:
        target = np.zeros((m, 3))
        for a in range(m):
            target[a] = layout.first[members[a]]
        align(X, target, known, c.d)
    for a in range(m):
        for b in range(a + 1, m):
            i, j = members[a], members[b]
            if not (s.nodes[i].present and s.nodes[j].present):
                start_filter(c, s, layout.pair_index[i, j], X[b] - X[a], D[a, b], t)
    for i in new:
        s.nodes[i].present = True


@kernel
def distance_between(c, s, layout, i, j, t):
    """Return the distance of nodes i < j by their filter, else by their first measurements [m]."""
    p = layout.pair_index[i, j]
    pair = s.pairs[p]
    if s.nodes[i].present and s.nodes[j].present:
        predict(c, s, p, t, s.x, s.P)
        pair.t = t
        return math.sqrt(s.x[p, 0, 0] ** 2 + s.x[p, 0, 1] ** 2 + s.x[p, 0, 2] ** 2)
    if pair.surveyed > 0.0:
        return pair.surveyed
    return pair.first_sum / pair.first_n


@kernel
def start_filter(c, s, p, x_0, distance, t):
    """Start the filter of a new pair with x_0, v_0 = 0 and P_0 = I."""
    pair = s.pairs[p]
    both_static = s.nodes[pair.i].static and s.nodes[pair.j].static
    s.x[p], s.P[p] = 0.0, 0.0
    for a in range(c.d):
        s.x[p, 0, POS + a] = x_0[a]
        s.P[p, 0, POS + a, POS + a] = 1.0
        s.P[p, 0, VEL + a, VEL + a] = 0.0 if both_static else 1.0
    pair.t, pair.t_range = t, t
    pair.mean, pair.last, pair.rate, pair.in_a_row = distance, distance, 0.0, 0
    forget_first(s, p)


@kernel
def forget_first(s, p):
    """Discard the first measurements of a pair."""
    s.pairs[p].first_sum, s.pairs[p].first_n = 0.0, 0


@allocating_kernel
def refine(c, s, layout, t):
    """Apply MDS to the group and feed its positions back to the filters."""
    s.group[0].n_since_mds = 0
    if c.feedback == NONE:
        return
    n = s.nodes.shape[0]
    members, m = np.zeros(n, np.int64), 0
    for i in range(n):
        if s.nodes[i].present:
            members[m] = i
            m += 1
    D = np.zeros((m, m))
    for a in range(m):
        for b in range(a + 1, m):
            D[a, b] = distance_between(c, s, layout, members[a], members[b], t)
            D[b, a] = D[a, b]
    X = classical_mds(D * D, c.d, c.power)
    if c.aligned:
        align(X, filter_positions(s, layout, members, m), np.ones(m, np.bool_), c.d)
    work = np.zeros((4, 6))
    for a in range(m):
        for b in range(a + 1, m):
            p = layout.pair_index[members[a], members[b]]
            pos = X[b] - X[a]
            if c.feedback == REPLACE:
                s.x[p, 0, :3] = pos
            else:
                correct_position(s, p, pos, c.d, c.mds_std * c.mds_std, work)


@kernel
def remove_node(s, layout, node):
    """Destroy the filters of a node that left."""
    s.nodes[node].present = False
    s.nodes[node].t_last_range = -np.inf
    present = 0
    for i in range(s.nodes.shape[0]):
        present += s.nodes[i].present
        if i != node:
            forget_first(s, layout.pair_index[i, node])
    if present < 2:
        for i in range(s.nodes.shape[0]):
            s.nodes[i].present = False
