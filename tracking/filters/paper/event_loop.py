"""Event loop: one pass in time order, which writes the estimates when they are due."""

from __future__ import annotations

import numpy as np

from tracking.filters.clear_estimate import clear_estimate
from tracking.filters.paper.group_feedback import initialise, refine, remove_node
from tracking.filters.paper.pair_filter import correct, passes_gate, predict
from tracking.filters.paper.state import PaperState
from tracking.kernels.jit import allocating_kernel, kernel

# Integer values of `Kind` and `Status`, since kernels cannot use enums.
STATE, SURVEY, RANGE, LEAVE = 3, 4, 5, 6
STARTING, OK, LOST = 1, 3, 4


@allocating_kernel
def run_events(constants, layout, state, block, t_out, out):
    """Process the events of every environment in order.

    Args:
        constants: Constants (`make_constants`), (1).
        layout: Tables.
        state: PaperState, updated.
        block: Events: t, kind, i, j, antenna_i, antenna_j, values, has_power, valid;
            (env, event, ...).
        t_out: Times at which estimates are due, ascending, (env, time) [s]. An estimate
            includes every event up to and including its time.
        out: Arrays written: pos, vel, cov, q, has_q, age, nis, nlos, status; (env, time, ...).
    """
    t, kind, node_i, node_j, _, _, values, _, valid = block
    c = constants[0]
    work = np.zeros((4, 6))
    x, P = np.zeros(state.x.shape[1:]), np.zeros(state.P.shape[1:])
    for e in range(t.shape[0]):
        s = PaperState(
            state.nodes[e],
            state.accel[e],
            state.q[e],
            state.pairs[e],
            state.group[e],
            state.x[e],
            state.P[e],
        )
        o = 0
        for k in range(t.shape[1]):
            if not valid[e, k]:
                continue
            while o < t_out.shape[1] and t_out[e, o] < t[e, k]:
                write_estimate(c, s, t_out[e, o], e, o, out, x, P)
                o += 1
            i, j = min(node_i[e, k], node_j[e, k]), max(node_i[e, k], node_j[e, k])
            if kind[e, k] == STATE:
                process_attitude(c, s, layout, i, t[e, k], values[e, k])
            elif kind[e, k] in (RANGE, SURVEY):
                is_survey = kind[e, k] == SURVEY
                update_range(c, s, layout, i, j, t[e, k], values[e, k, 0], is_survey, work)
            elif kind[e, k] == LEAVE:
                remove_node(s, layout, i)
        while o < t_out.shape[1]:
            write_estimate(c, s, t_out[e, o], e, o, out, x, P)
            o += 1


@kernel
def process_attitude(c, s, layout, i, t, values):
    """Predict the pairs of node i to time t, then hold its controls, eq. (1) and (2)."""
    if s.nodes[i].present:
        for j in range(s.nodes.shape[0]):
            if j != i and s.nodes[j].present:
                p = layout.pair_index[i, j]
                predict(c, s, p, t, s.x, s.P)
                s.pairs[p].t = t
    for a in range(3):
        s.accel[i, a] = values[4 + a] if a < c.d else 0.0
    for a in range(4):
        s.q[i, a] = values[a]
    s.nodes[i].t_imu = t


@allocating_kernel
def update_range(c, s, layout, i, j, t, distance, is_survey, work):
    """Correct the filter of nodes i < j, or collect their first k measurements."""
    present = 0
    for node in range(s.nodes.shape[0]):
        if t - s.nodes[node].t_last_range > c.node_timeout and s.nodes[node].t_last_range > -np.inf:
            remove_node(s, layout, node)
    for node in range(s.nodes.shape[0]):
        present += s.nodes[node].present
    s.nodes[i].t_last_range, s.nodes[j].t_last_range = t, t
    p = layout.pair_index[i, j]
    pair, group = s.pairs[p], s.group[0]
    if is_survey:
        pair.surveyed = distance
    if not (s.nodes[i].present and s.nodes[j].present):
        if pair.first_n < c.k and not is_survey:
            pair.first_sum += distance
            pair.first_n += 1
        initialise(c, s, layout, t)
        return
    predict(c, s, p, t, s.x, s.P)
    pair.t = t
    if passes_gate(c, s, p, t, distance):
        pair.nis = correct(c, s, p, distance, work)
        group.nis_sum += pair.nis
        group.nis_n += 1
        group.n_since_mds += 1
    if group.n_since_mds >= present * (present - 1) // 2 and present > 2:
        refine(c, s, layout, t)


@allocating_kernel
def write_estimate(c, s, t, e, o, out, x, P):
    """Write the estimate of every filter, predicted to time t; the state does not change."""
    clear_estimate(e, o, out)
    pos, vel, cov, q_wb, has_q, age, nis, _, status = out
    for n in range(s.nodes.shape[0]):
        has_q[e, o, n] = s.nodes[n].t_imu > -np.inf
        for k in range(4):
            q_wb[e, o, n, k] = s.q[n, k]
    for p in range(s.pairs.shape[0]):
        pair = s.pairs[p]
        node_i, node_j = s.nodes[pair.i], s.nodes[pair.j]
        nis[e, o, p] = pair.nis
        if not (node_i.present and node_j.present):
            oldest = min(node_i.t_last_range, node_j.t_last_range)
            status[e, o, p] = STARTING if t - oldest <= c.node_timeout else 0
            continue
        x[p], P[p] = s.x[p], s.P[p]
        predict(c, s, p, t, x, P)
        pos[e, o, p], vel[e, o, p] = x[p, 0, :3], x[p, 0, 3:]
        cov[e, o, p] = P[p, 0]
        age[e, o, p] = t - pair.t_range
        both_static = node_i.static and node_j.static
        status[e, o, p] = OK if age[e, o, p] <= c.lost_after or both_static else LOST
