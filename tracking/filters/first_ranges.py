"""First ranges of each pair, and the first shape of a group from them by classical MDS."""

from __future__ import annotations

import numpy as np

from tracking.kernels.jit import allocating_kernel, kernel

N_FIRST = 8
"""Number of newest ranges of a pair that are kept until its filter runs."""


@kernel
def collect(c, pair, t, distance, is_survey):
    """Store a range of a pair that does not run yet, or its surveyed distance permanently."""
    if is_survey:
        pair.surveyed = distance
        return
    if pair.start_n > 0 and t - newest_first(pair) > c.node_timeout:
        pair.start_n = 0
    if pair.start_n == 0:
        pair.t_start = t
    pair.start_r[pair.start_n % N_FIRST] = distance
    pair.start_t[pair.start_n % N_FIRST] = t
    pair.start_n += 1


@kernel
def is_ready(c, s, layout, i, j, t):
    """True if a pair has k recent ranges, `min_ranges` over a longer time, or is surveyed."""
    pair = s.pairs[layout.pair_index[i, j]]
    if pair.surveyed > 0.0:
        return True
    n = min(pair.start_n, N_FIRST)
    if n < c.min_ranges:
        return False
    oldest, newest = pair.start_t[(pair.start_n - n) % N_FIRST], newest_first(pair)
    if pair.start_n >= c.start_k and t - oldest <= c.start_max_age:
        return True
    is_recent = t - newest <= max(c.start_max_age, c.min_ranges * (newest - oldest) / (n - 1))
    return is_recent and t - pair.t_start >= c.start_max_age


@kernel
def newest_first(pair):
    """Return the time of the newest of a pair's first ranges [s]."""
    return pair.start_t[(pair.start_n - 1) % N_FIRST]


@allocating_kernel
def start_distance(c, s, layout, i, j):
    """Return the surveyed distance of a pair, or the median of its newest ranges, and the scatter.

    The median of eight is robust against three outliers. Ranges within `start_max_age` of the
    newest count, `min_ranges` at least; their scatter is 1.5 times the median absolute deviation,
    which for normal errors is their standard deviation.

    Returns:
        Distance and scatter [m].
    """
    pair = s.pairs[layout.pair_index[i, j]]
    if pair.surveyed > 0.0:
        return pair.surveyed, 0.0
    n = min(pair.start_n, N_FIRST)
    newest = newest_first(pair)
    kept, m = np.zeros(N_FIRST), 0
    for k in range(n):
        at = (pair.start_n - 1 - k) % N_FIRST
        if k < c.min_ranges or newest - pair.start_t[at] <= c.start_max_age:
            kept[m] = pair.start_r[at]
            m += 1
    middle = np.median(kept[:m])
    return middle, 1.5 * np.median(np.abs(kept[:m] - middle))


@kernel
def forget_first(pair):
    """Discard the first ranges of a pair; a surveyed distance is kept."""
    pair.start_n = 0


@allocating_kernel
def choose_members(c, s, layout, members, t):
    """Write nodes whose pairs are all ready to `members`; return how many, 0 if too few to start.

    Nodes with the most ready pairs come first, so that the numbering has no effect.
    """
    n = s.nodes.shape[0]
    rank, order = np.empty(n), np.empty(n, np.int64)
    for i in range(n):
        rank[i], place = readiness(c, s, layout, i, t), i
        while place > 0 and rank[order[place - 1]] < rank[i]:
            order[place] = order[place - 1]
            place -= 1
        order[place] = i
    for first in order:
        m = 1
        members[0] = first
        for k in order:
            fits = k != first
            for a in range(m):
                if fits and (members[a] == k or not is_ready(c, s, layout, members[a], k, t)):
                    fits = False
            if fits:
                members[m] = k
                m += 1
        if m >= min(3, n):
            members[:m] = np.sort(members[:m])
            return m
    return 0


@kernel
def readiness(c, s, layout, i, t):
    """Return the number of ready pairs of node i, plus a fraction that falls with its distances."""
    n, way = 0, 0.0
    for k in range(s.nodes.shape[0]):
        if k != i and is_ready(c, s, layout, i, k, t):
            pair = s.pairs[layout.pair_index[i, k]]
            newest = pair.start_r[(pair.start_n - 1) % N_FIRST]
            way += pair.surveyed if pair.surveyed > 0.0 else newest
            n += 1
    return n + 1.0 / (2.0 + way)


@allocating_kernel
def first_shape(c, s, layout, members, m):
    """Return the positions of the members about their centre by MDS of the first ranges, (m, 3)."""
    D2 = np.zeros((m, m))
    for a in range(m):
        for b in range(m):
            if a != b:
                D2[a, b] = start_distance(c, s, layout, members[a], members[b])[0] ** 2
    return classical_mds(D2, c.d, 0.5)


@allocating_kernel
def classical_mds(D2, d, power):
    """Return positions about their centre, (node, 3), from squared distances D2, (node, node).

    They are the eigenvectors of ``K = -J D2 J / 2`` times the given power of its eigenvalues: 0.5
    reproduces the distances (`tracking.maths.mds`).
    """
    n = D2.shape[0]
    J = np.eye(n) - 1.0 / n
    eigenvalues, E = np.linalg.eigh(-0.5 * J @ D2 @ J)
    X = np.zeros((n, 3))
    for k in range(min(d, n)):
        along = E[:, n - 1 - k]
        # LAPACK's signs differ with machine and numbering: here the sum of cubes is not negative.
        sign = -1.0 if np.sum(along**3) < 0.0 else 1.0
        X[:, k] = sign * along * max(eigenvalues[n - 1 - k], 0.0) ** power
    return X
