"""Nodes at a wrong place: found by what they range, and moved to where that fits.

A node can settle where some of its ranges fit and others never do: on the wrong side of the
others, after a start or a join from few ranges. There the filter stays, for the ranges that
would lead it away fit nothing and hardly count. But what it ranges tells of it: steady ranges,
some too short, which no obstacle makes them, some too long, and a place that all of them agree
on. Ranges that err alike are of a wrong calibration, and those that scatter mean nothing: both
are for `_doubt_kernels`.
"""

from __future__ import annotations

import numpy as np

from tracking.compiled import allocating_kernel, kernel, small_kernel
from tracking.filters.joint._doubt_kernels import ranges_now
from tracking.filters.joint._place_kernels import SHORT, best_place, misfit, sum_of_misfits
from tracking.filters.joint._start_kernels import add_node

SETTLED = 10
"""[-] Ranges after which the running mean of what a pair ranges beyond its prediction counts."""
STEADY = 0.25
"""[m] Those that scatter more about it mean nothing."""
CONTRADICTED = 24.0
"""[-] Sum of misfits of a node's ranges from which on another place is looked for: more than one
range has to be wrong, for which the other end may be to blame."""
BETTER = 0.25
"""[-] Another place has to bring the sum below this part of it."""


@kernel
def watch_places(c, s, layout, t):
    """Move the node that its ranges contradict most, if there is a place that they agree on."""
    worst, most = -1, CONTRADICTED
    for i in range(s.nodes.shape[0]):
        if s.nodes[i].present and not s.nodes[i].static:
            total, n = contradiction(c, s, layout, i, t)
            if n > c.d and total > most:
                worst, most = i, total
    if worst >= 0:
        move_node(c, s, layout, worst, t)


@kernel
def contradiction(c, s, layout, i, t):
    """What the ranges of node i say against its place, and how many there are.

    Nothing where all of them are too long, or all too short.
    """
    total, n, least, greatest = 0.0, 0, 0.0, 0.0
    for k in range(s.nodes.shape[0]):
        if k != i and has_settled(c, s, layout, i, k, t):
            error = slow_error(s, layout.pair_index[i, k])
            total += misfit(error)
            least, greatest = min(least, error), max(greatest, error)
            n += 1
    return total if least < -SHORT and greatest > SHORT else 0.0, n


@small_kernel
def has_settled(c, s, layout, i, k, t):
    """True if nodes i and k range with each other, and have for a while."""
    p = layout.pair_index[i, k]
    pair = s.pairs[p]
    return ranges_now(c, s, p, t) and pair.n_ranges >= SETTLED and pair.scatter < STEADY


@small_kernel
def slow_error(s, p):
    """By how much pair p lately ranges more than its distance [m], in the best hypothesis."""
    error = s.pairs[p].beyond
    if s.pairs[p].at_e >= 0:
        at, h = s.pairs[p].at_e, s.group[0].best
        error += s.x[h, at] + s.x[h, at + 1]
    return error


@allocating_kernel
def move_node(c, s, layout, i, t):
    """Move node i, in every hypothesis, to where its ranges fit much better, if there is such."""
    n = s.nodes.shape[0]
    others, m = np.empty(n, np.int64), 0
    for k in range(n):
        if k != i and has_settled(c, s, layout, i, k, t):
            others[m] = k
            m += 1
    known, distance, pos = np.zeros((m, 3)), np.empty(m), np.zeros(3)
    read_places(c, s, s.group[0].best, i, others, known, pos)
    for a in range(m):
        way = np.sqrt(np.sum((known[a] - pos) ** 2))
        distance[a] = max(way + slow_error(s, layout.pair_index[i, others[a]]), 0.0)
    moved = False
    for h in range(s.alive.shape[0]):
        if s.alive[h]:
            read_places(c, s, h, i, others, known, pos)
            before = sum_of_misfits(known, distance, pos)
            if before > CONTRADICTED:
                after = best_place(c.d, known, distance, pos)
                if after < BETTER * before:
                    add_node(c, s, layout, h, i, pos, t)
                    moved = True
    if moved:
        s.nodes[i].astray = 0.0


@kernel
def read_places(c, s, h, i, others, known, pos):
    """Positions of others into known (other, 3), and of node i into pos, in hypothesis h [m]."""
    for k in range(c.d):
        pos[k] = s.x[h, s.nodes[i].at_p + k]
        for a in range(known.shape[0]):
            known[a, k] = s.x[h, s.nodes[others[a]].at_p + k]
