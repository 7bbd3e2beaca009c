"""The first shape of a group and the place of a newcomer, from the first ranges of each pair."""

from __future__ import annotations

import numpy as np

from tracking.jit import allocating_kernel, kernel

N_FIRST = 8
"""Ranges of a pair that are kept until it runs, the newest."""
FEWEST = 3
"""Fewer say nothing of how far they are to be trusted: one may be absurd."""
MIN_EXTENT = 0.1
"""[m] Along an axis of which others extend less, the errors of ranges are all that they tell."""


@kernel
def collect(c, pair, t, distance, is_survey):
    """Keep a range of a pair that does not run yet, or a surveyed distance, for good."""
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
    """True when a pair has k ranges of a short time, or what came in a longer one is enough."""
    pair = s.pairs[layout.pair_index[i, j]]
    if pair.surveyed > 0.0:
        return True
    n = min(pair.start_n, N_FIRST)
    if n < FEWEST:
        return False
    oldest, newest = pair.start_t[(pair.start_n - n) % N_FIRST], newest_first(pair)
    if pair.start_n >= c.start_k and t - oldest <= c.start_max_age:
        return True
    is_recent = t - newest <= max(c.start_max_age, FEWEST * (newest - oldest) / (n - 1))
    return is_recent and t - pair.t_start >= c.start_max_age


@kernel
def newest_first(pair):
    """Time of the newest of a pair's first ranges [s]."""
    return pair.start_t[(pair.start_n - 1) % N_FIRST]


@allocating_kernel
def start_distance(c, s, layout, i, j):
    """Surveyed distance of a pair, or the median of its newest ranges, and how far these scatter.

    The median of eight holds against three that are absurd. Ranges of the same `start_max_age`
    count, three at least; their scatter is 1.5 times the median deviation, which for normal
    errors is their standard deviation.

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
        if k < FEWEST or newest - pair.start_t[at] <= c.start_max_age:
            kept[m] = pair.start_r[at]
            m += 1
    middle = np.median(kept[:m])
    return middle, 1.5 * np.median(np.abs(kept[:m] - middle))


@kernel
def forget_first(pair):
    """Begin to collect the first ranges of a pair; a surveyed distance is kept."""
    pair.start_n = 0


@kernel
def choose_members(c, s, layout, members, t):
    """Nodes of which all pairs are ready, written; returns how many, 0 if too few to start."""
    n = s.nodes.shape[0]
    for first in range(n):
        members[0] = first
        m = 1
        for k in range(n):
            fits = k != first
            for a in range(m):
                if fits and (members[a] == k or not is_ready(c, s, layout, members[a], k, t)):
                    fits = False
            if fits:
                members[m] = k
                m += 1
        if m >= min(3, n):
            return m
    return 0


@allocating_kernel
def place(d, min_spread, merge_distance, known, distance, sides):
    """Where a node is, from its distances to known ones; both candidates if a mirror fits too.

    Args:
        d: 2 or 3.
        min_spread: A layout with less extent along an axis does not span it [m].
        merge_distance: A node nearer than this to the plane of the others has no other side [m].
        known: Positions, (known, 3) [m].
        distance: Distances to them, (known) [m].
        sides: The candidates, (2, 3), written.

    Returns:
        1 if the known nodes span the space, 2 if they are too flat to tell the side.
    """
    _, _, extent, _ = main_axes(d, known)
    flat = extent[d - 1] <= min_spread
    height = place_across(d, known, distance, d - 1 if flat else d, sides)
    return 2 if flat and height >= merge_distance else 1


@allocating_kernel
def main_axes(d, known):
    """Centre of positions, what they are from it, extent along their main axes, and the axes.

    Extents are root mean squares [m], the longest first; axes are rows.
    """
    centre = np.zeros(d)
    for a in range(known.shape[0]):
        centre += known[a, :d] / known.shape[0]
    A = known[:, :d].copy() - centre
    _, S, axes = np.linalg.svd(A.T.copy() @ A)
    return centre, A, np.sqrt(S / known.shape[0]), axes


@allocating_kernel
def place_across(d, known, distance, axis, sides):
    """Where a node is by least squares of squared distances, with one axis of the others left open.

    On both sides along it, so far away that the distances are right in the mean.

    Args:
        d: 2 or 3.
        known: Positions, (known, 3) [m].
        distance: Distances to them, (known) [m].
        axis: Which of their main axes is open, the longest first; d for none. Others along which
            they hardly extend say nothing either.
        sides: The places, (2, 3), written.

    Returns:
        How far from the others the places are along that axis [m].
    """
    m = known.shape[0]
    centre, A, extent, axes = main_axes(d, known)
    # |p|^2 - 2 a.p + |a|^2 = d^2: its differences from the mean are linear in p.
    b = np.zeros(m)
    for a in range(m):
        b[a] = 0.5 * (np.sum(A[a] * A[a]) - distance[a] ** 2)
    b -= np.mean(b)
    p = np.zeros(d)
    for k in range(d):
        if k != axis and extent[k] > MIN_EXTENT:
            along = axes[k].copy()
            p += along * (np.sum((A @ along) * b) / (m * extent[k] ** 2))
    height2 = 0.0
    for a in range(m):
        height2 += (distance[a] ** 2 - np.sum((p - A[a]) ** 2)) / m
    height = np.sqrt(max(height2, 0.0)) if axis < d else 0.0
    sides[:, :] = 0.0
    for side in range(2):
        up = height if side == 0 else -height
        for k in range(d):
            sides[side, k] = centre[k] + p[k]
            if axis < d:
                sides[side, k] += up * axes[axis, k]
    return height


@allocating_kernel
def first_shape(c, s, layout, members, m):
    """Classical MDS of the first ranges: positions of the members round their centre, (m, 3)."""
    D2 = np.zeros((m, m))
    for a in range(m):
        for b in range(m):
            if a != b:
                D2[a, b] = start_distance(c, s, layout, members[a], members[b])[0] ** 2
    J = np.eye(m) - 1.0 / m
    eigenvalues, E = np.linalg.eigh(-0.5 * J @ D2 @ J)
    X = np.zeros((m, 3))
    for k in range(min(c.d, m)):
        X[:, k] = E[:, m - 1 - k] * np.sqrt(max(eigenvalues[m - 1 - k], 0.0))
    return X
