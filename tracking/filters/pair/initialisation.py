"""Initialisation of a group and of joining nodes, from the first ranges of each pair.

A group starts with MDS on the medians of the first ranges, once for every rotation and mirror
image of the bank. A joining node is placed by least squares on its distances to the present
nodes, in every hypothesis; if these are too few or too flat to determine its side, both sides
become hypotheses. Velocities start at zero and P at the identity.
"""

from __future__ import annotations

import numpy as np

from tracking.filters.first_ranges import (
    N_FIRST,
    choose_members,
    first_shape,
    is_ready,
    start_distance,
)
from tracking.filters.pair.nlos_model import E
from tracking.kernels.jit import allocating_kernel, kernel
from tracking.maths.linear_multilateration import place


@kernel
def initialise_pair(c, s, h, p, pos, t):
    """Initialise the filter of pair p at a relative position, with v = 0 and P = I."""
    pair = s.pairs[p]
    both_static = s.nodes[pair.i].static and s.nodes[pair.j].static
    s.x[p, h, :] = 0.0
    s.P[p, h, :, :] = 0.0
    for k in range(c.d):
        s.x[p, h, k] = pos[k]
        s.P[p, h, k, k] = 1.0
        s.P[p, h, 3 + k, 3 + k] = 0.0 if both_static else 1.0
    s.P[p, h, E, E] = c.slow_var
    s.nlos[p, h] = c.first_prob
    pair.t = t
    n = min(pair.start_n, N_FIRST)
    first = pair.start_t[(pair.start_n - n) % N_FIRST]
    pair.interval = (t - first) / (n - 1) if n > 1 else 0.0
    pair.t_range, pair.t_used = t, t
    pair.n_ranges = 0
    pair.in_a_row = 0


@kernel
def forget_mean(c, s, t):
    """Reset the mean velocity and its sums at time t, since the members of the group change."""
    s.group[0].dv0, s.group[0].dv1 = 0.0, 0.0
    for i in range(s.nodes.shape[0]):
        s.nodes[i].t_sum = t
    s.mean_v[:] = 0.0
    s.mean_cov[:] = 0.0
    s.mean_cov[:, 0, 0] = c.group_speed_var
    s.mean_cov[:, 1, 1] = c.group_speed_var


@allocating_kernel
def try_start(c, s, layout, t):
    """Start the group with the nodes whose pairs are all ready."""
    members = np.empty(s.nodes.shape[0], np.int64)
    m = choose_members(c, s, layout, members, t)
    if m == 0:
        return
    X = first_shape(c, s, layout, members, m)
    for a in range(m):
        s.nodes[members[a]].present = True
    for h in range(layout.rotations.shape[0]):
        s.alive[h] = True
        s.loglik[h] = 0.0
        Y = X @ layout.rotations[h].T.copy()
        for a in range(m):
            for b in range(m):
                if members[a] < members[b]:
                    p = layout.pair_index[members[a], members[b]]
                    initialise_pair(c, s, h, p, Y[b] - Y[a], t)
    forget_mean(c, s, t)
    group = s.group[0]
    group.started = True
    group.flat = False
    group.n_alive = layout.rotations.shape[0]
    group.best, group.undecided = 0, True
    group.t_check = t
    group.t_mds = t
    group.t_wheels = t
    group.misfit = 0.0


@kernel
def hypothesis_positions(s, layout, h, pos):
    """Write the positions of the present nodes in hypothesis h about their centre, (node, 3)."""
    n = pos.shape[0]
    n_present = 0
    for i in range(n):
        n_present += s.nodes[i].present
    for j in range(n):
        for k in range(3):
            total = 0.0
            for i in range(n):
                if i != j and s.nodes[i].present and s.nodes[j].present:
                    v = s.x[layout.pair_index[i, j], h, k]
                    total += v if i < j else -v
            pos[j, k] = total / n_present


@allocating_kernel
def try_join(c, s, layout, new, t):
    """Add a node to the group once its pairs with enough of the others are ready."""
    n = s.nodes.shape[0]
    n_present, n_ready = 0, 0
    ready = np.empty(n, np.int64)
    for k in range(n):
        if s.nodes[k].present:
            n_present += 1
            if is_ready(c, s, layout, new, k, t):
                ready[n_ready] = k
                n_ready += 1
    if n_ready < min(c.d + 1, n_present):
        return
    pos, sides = np.zeros((n, 3)), np.empty((2, 3))
    known, distance = np.empty((n_ready, 3)), np.empty(n_ready)
    n_hyps = s.alive.shape[0]
    was_alive = s.alive.copy()
    for h in range(n_hyps):
        if not was_alive[h]:
            continue
        hypothesis_positions(s, layout, h, pos)
        for a in range(n_ready):
            known[a] = pos[ready[a]]
            distance[a], _ = start_distance(c, s, layout, new, ready[a])
        n_sides = place(c.d, c.mds_min_spread, c.merge_distance, known, distance, sides)
        for side in range(n_sides):
            target = h if side == 0 else copy_hypothesis(s, h)
            if target < 0:
                break
            for k in range(n):
                if s.nodes[k].present:
                    sign = 1.0 if k < new else -1.0
                    p = layout.pair_index[k, new]
                    initialise_pair(c, s, target, p, sign * (sides[side] - pos[k]), t)
    s.nodes[new].present = True
    forget_mean(c, s, t)


@allocating_kernel
def copy_hypothesis(s, h):
    """Copy a hypothesis to a free slot of the bank; return the slot, -1 if there is none."""
    for free in range(s.alive.shape[0]):
        if not s.alive[free]:
            s.alive[free] = True
            s.loglik[free] = s.loglik[h]
            s.x[:, free] = s.x[:, h]
            s.P[:, free] = s.P[:, h]
            s.nlos[:, free] = s.nlos[:, h]
            s.mean_v[free] = s.mean_v[h]
            s.mean_cov[free] = s.mean_cov[h]
            s.group[0].n_alive += 1
            return free
    return -1
