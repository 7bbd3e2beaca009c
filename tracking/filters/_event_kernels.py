"""The loop over events: one pass in time order, estimates written where they are due."""

from __future__ import annotations

import numpy as np
from tracking.compiled import kernel

from tracking.filters._bank_kernels import (
    prune_bank,
    refine_group,
    remove_node,
    remove_silent,
)
from tracking.filters._range_kernels import advance_pair, fuse_range, fuse_survey, node_psd
from tracking.filters._pair_kernels import predict
from tracking.filters._start_kernels import collect, try_join, try_start

# Plain numbers of `Kind` and `Status`: kernels do not know enums.
JOIN, STATE, SURVEY, RANGE, LEAVE = 0, 3, 4, 5, 6
ABSENT, STARTING, AMBIGUOUS, OK, LOST = 0, 1, 2, 3, 4


@kernel
def run_events(c, nodes, pairs, bank, block, t_out, out):
    """Handle the events of every environment in order.

    Args:
        c: Coefficients.
        nodes: NodeState, updated.
        pairs: PairState, updated.
        bank: BankState, updated.
        block: Events: t, kind, i, j, antenna_i, antenna_j, values, valid; (env, event, ...).
        t_out: Times at which estimates are due, ascending, (env, time) [s]. An estimate
            holds every event up to its time, that time included.
        out: Arrays written: pos, vel, cov, q, has_q, age, nis, status; (env, time, ...).
    """
    t, kind, node_i, node_j, antenna_i, antenna_j, values, valid = block
    for e in range(t.shape[0]):
        o = 0
        for k in range(t.shape[1]):
            if not valid[e, k]:
                continue
            while o < t_out.shape[1] and t_out[e, o] < t[e, k]:
                write_estimate(c, nodes, pairs, bank, e, t_out[e, o], o, out)
                o += 1
            i, j, what = node_i[e, k], node_j[e, k], kind[e, k]
            if what == STATE:
                take_state(c, nodes, pairs, bank, e, i, t[e, k], values[e, k])
            elif what == RANGE or what == SURVEY:
                a_i, a_j = antenna_i[e, k], antenna_j[e, k]
                if i > j:
                    i, j, a_i, a_j = j, i, a_j, a_i
                distance = values[e, k, 0]
                take_range(
                    c, nodes, pairs, bank, e, i, j, a_i, a_j, t[e, k], distance, what == SURVEY
                )
            elif what == LEAVE or (what == JOIN and nodes.present[e, i]):
                remove_node(c, nodes, pairs, bank, e, i)
        while o < t_out.shape[1]:
            write_estimate(c, nodes, pairs, bank, e, t_out[e, o], o, out)
            o += 1


@kernel
def take_state(c, nodes, pairs, bank, e, i, t, values):
    """A new orientation and acceleration of node i, held until the next."""
    if nodes.present[e, i]:
        for k in range(nodes.present.shape[1]):
            if k != i and nodes.present[e, k]:
                advance_pair(c, nodes, pairs, bank, e, c.pair_index[i, k], t)
    nodes.q_wb[e, i] = values[:4]
    nodes.accel_w[e, i] = values[4:7]
    nodes.t_state[e, i] = t
    nodes.has_state[e, i] = True


@kernel
def take_range(c, nodes, pairs, bank, e, i, j, a_i, a_j, t, distance, is_survey):
    """A range or survey between i and j, i < j."""
    if t - bank.t_check[e] >= c.check_period:
        remove_silent(c, nodes, pairs, bank, e, t)
        prune_bank(c, nodes, pairs, bank, e)
        bank.t_check[e] = t
    p = c.pair_index[i, j]
    for n in (i, j):
        nodes.heard[e, n] = True
        nodes.t_heard[e, n] = t
    if not (nodes.present[e, i] and nodes.present[e, j]):
        collect(c, pairs, e, p, t, distance, c.start_k if is_survey else 1)
        if not np.any(nodes.present[e]):
            try_start(c, nodes, pairs, bank, e, t)
        else:
            for n in (i, j):
                if not nodes.present[e, n]:
                    try_join(c, nodes, pairs, bank, e, n, t)
        return
    advance_pair(c, nodes, pairs, bank, e, p, t)
    if is_survey:
        fuse_survey(c, pairs, bank, e, p, distance)
        pairs.t_range[e, p] = t
    else:
        fuse_range(c, nodes, pairs, bank, e, p, t, distance, a_i, a_j)
    if c.use_mds and t - bank.t_mds[e] >= c.mds_period:
        for q in range(c.pairs.shape[0]):
            if nodes.present[e, c.pairs[q, 0]] and nodes.present[e, c.pairs[q, 1]]:
                advance_pair(c, nodes, pairs, bank, e, q, t)
        refine_group(c, nodes, pairs, bank, e)
        bank.t_mds[e] = t


@kernel
def write_estimate(c, nodes, pairs, bank, e, t, o, out):
    """The best hypothesis at time t, without touching the state."""
    pos, vel, cov, q_wb, has_q, age, nis, status = out
    h = bank.best[e]
    ambiguous = np.sum(bank.alive[e]) > 1
    x, P = np.empty(6), np.empty((6, 6))
    a_i, a_j = np.zeros(3), np.zeros(3)
    q_wb[e, o] = nodes.q_wb[e]
    has_q[e, o] = nodes.has_state[e]
    for p in range(c.pairs.shape[0]):
        i, j = c.pairs[p, 0], c.pairs[p, 1]
        nis[e, o, p] = pairs.nis[e, p]
        if not (nodes.present[e, i] and nodes.present[e, j]):
            heard = nodes.heard[e, i] and nodes.heard[e, j]
            status[e, o, p] = STARTING if heard else ABSENT
            pos[e, o, p], vel[e, o, p], cov[e, o, p], age[e, o, p] = 0.0, 0.0, 0.0, 0.0
            continue
        x[:] = pairs.x[e, h, p]
        P[:] = pairs.P[e, h, p]
        psd_i, aided_i = node_psd(c, nodes, e, i, t)
        psd_j, aided_j = node_psd(c, nodes, e, j, t)
        for k in range(3):
            a_i[k] = nodes.accel_w[e, i, k] if aided_i else 0.0
            a_j[k] = nodes.accel_w[e, j, k] if aided_j else 0.0
        psd = np.sqrt(psd_i * psd_i + psd_j * psd_j)
        predict(x, P, t - pairs.t[e, p], a_i, a_j, psd, c.d)
        pos[e, o, p] = x[:3]
        vel[e, o, p] = x[3:]
        cov[e, o, p] = P
        age[e, o, p] = t - pairs.t_range[e, p]
        rigid = c.is_static[i] and c.is_static[j]
        if ambiguous:
            status[e, o, p] = AMBIGUOUS
        elif age[e, o, p] > c.lost_after and not rigid:
            status[e, o, p] = LOST
        else:
            status[e, o, p] = OK
