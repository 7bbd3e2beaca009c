"""Nodes that disagree with the group: wrong calibrations, liars, and nodes that lost their way.

Two signs are looked for, ten times a second, in nodes that range with two others or more:

    astray   most ranges of the node fit nothing, while those among the others do
    offset   the errors of all its ranges are large and of one sign: an obstacle hides a node from
             some, a wrong calibration lengthens all of its ranges alike

Such a node is doubted: its pairs are reported so, an offset common to its ranges becomes
possible and, where it is astray, its position and velocity become uncertain. What it ranges then
moves the node and the offset, and hardly the others; where it only lost its way, it is found again.
"""

from __future__ import annotations

import math

from tracking.compiled import kernel, small_kernel
from tracking.filters.joint._sight_kernels import MIN_PROB

RECENT = 0.02
"""[-] Weight of a range in the share of a node's ranges that do not fit."""
LATELY = 0.1
"""[-] The same of what it ranges beyond what is predicted."""
FAR = 1.0
"""[m] A single range pulls no further than this."""
FAST = 10.0
"""[m/s] Ranges that change faster jump."""
STAYS = 0.5
"""[-] It remains one down to this part of it."""
MISSED = 3.0
"""[-] A pair ranges no longer after so many of its usual intervals, if these are long."""
HELD = 2.0
"""[s] A node is doubted until nothing has been found for so long."""
ASTRAY, LOST = 0.6, 0.4
"""[-] Share of a node's ranges that do not fit from which on it is astray; share of all ranges
that do, below which the filter is lost."""
SPEED = 0.7
"""[m/sqrt(s), m/s/sqrt(s)] How fast position and velocity of a node that is astray may become
others."""
JUMP, WANDER = 0.7, 1.0
"""[m, m/sqrt(s)] What the offset of a doubted node's ranges may be at first, and how fast it may
become another."""


@small_kernel
def note_fit(s, p, dt, distance, fits, nu):
    """Count a range [m] of pair p, dt after its last [s]: fits, 1, or not, 0; nu too long [m]."""
    pair = s.pairs[p]
    if pair.n_ranges > 0:
        jump = max(abs(distance - pair.last_used) - FAST * dt, 0.0)
        pair.jumps += LATELY * (min(jump, FAR) - pair.jumps)
    pair.last_used = distance
    pair.residual += LATELY * (nu - pair.residual)
    off = min(max(nu - pair.beyond, -FAR), FAR)
    pair.beyond += LATELY * off
    pair.scatter += LATELY * (abs(off) - pair.scatter)
    for i in (pair.i, pair.j):
        s.nodes[i].astray += RECENT * (1.0 - fits - s.nodes[i].astray)


@kernel
def watch_nodes(c, s, layout, t):
    """Doubt nodes that disagree with the group; tell whether it is the group that is lost."""
    group = s.group[0]
    dt = t - group.t_check
    worst = -1
    for i in range(s.nodes.shape[0]):
        node = s.nodes[i]
        if not node.present:
            node.astray, node.doubted = 0.0, False
        elif worst < 0 or node.astray > s.nodes[worst].astray:
            worst = i
    blames = worst >= 0 and others_fit(c, s, worst, t)
    group.diverged = group.fit < LOST and not blames
    for i in range(s.nodes.shape[0]):
        node = s.nodes[i]
        if not node.present:
            continue
        n, offset = common_error(c, s, layout, i, t)
        astray = i == worst and blames and node.astray > ASTRAY
        limit = c.common_error / math.sqrt(max(n, 1)) * (STAYS if node.doubted else 1.0)
        if n >= 2 and (astray or offset > limit):
            if not node.doubted:
                free_offset(s, layout, i, JUMP**2)
            else:
                free_offset(s, layout, i, WANDER**2 * dt)
                if astray:
                    open_node(c, s, i, SPEED**2 * dt)
            node.doubted, node.t_doubted = True, t
        elif node.doubted and t - node.t_doubted > HELD:
            node.doubted = False


@kernel
def others_fit(c, s, i, t):
    """True if there are pairs without node i, and none of them contradicts the rest."""
    n = 0
    for p in range(s.pairs.shape[0]):
        pair = s.pairs[p]
        if pair.i != i and pair.j != i and ranges_now(c, s, p, t):
            n += 1
            if pair.misfit > c.doubt:
                return False
    return n > 0


@small_kernel
def ranges_now(c, s, p, t):
    """True if both nodes of pair p are there and it was ranged lately."""
    pair = s.pairs[p]
    both = s.nodes[pair.i].present and s.nodes[pair.j].present
    waits = max(c.lost_after, MISSED * pair.interval)
    return both and pair.n_ranges > 0 and t - pair.t_range < waits


@kernel
def common_error(c, s, layout, i, t):
    """How many others node i ranges with; the least slow error of those, 0 if signs differ [m]."""
    h, n, sign, least = s.group[0].best, 0, 0.0, math.inf
    for k in range(s.nodes.shape[0]):
        # Surveyed distances between static nodes are not of their radios.
        if k == i or (s.nodes[i].static and s.nodes[k].static):
            continue
        p = layout.pair_index[i, k]
        if not ranges_now(c, s, p, t):
            continue
        n += 1
        error = s.pairs[p].residual
        if s.pairs[p].at_e >= 0:
            error += s.x[h, s.pairs[p].at_e + 1]
        if sign == 0.0:
            sign = 1.0 if error > 0.0 else -1.0
        least = min(least, sign * error)
    return n, max(least, 0.0) if n > 0 else 0.0


@kernel
def open_node(c, s, i, variance):
    """Know less about where node i is and how it moves."""
    node = s.nodes[i]
    for h in range(s.alive.shape[0]):
        if s.alive[h] and not node.static:
            for k in range(c.d):
                s.P[h, node.at_p + k, node.at_p + k] += variance
                s.P[h, node.at_v + k, node.at_v + k] += variance


@kernel
def free_offset(s, layout, i, variance):
    """Let the slow errors of all ranges of node i move together; none is for want of sight."""
    n = s.nodes.shape[0]
    for h in range(s.alive.shape[0]):
        if not s.alive[h]:
            continue
        for k in range(n):
            p = layout.pair_index[i, k] if k != i else -1
            if p < 0 or s.pairs[p].at_e < 0 or not s.nodes[k].present:
                continue
            s.nlos[h, p] = 1.0 - MIN_PROB
            for m in range(n):
                q = layout.pair_index[i, m] if m != i else -1
                if q >= 0 and s.pairs[q].at_e >= 0 and s.nodes[m].present:
                    s.P[h, s.pairs[p].at_e + 1, s.pairs[q].at_e + 1] += variance
