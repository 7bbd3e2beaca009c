"""Event loop: one pass in time order, which writes the estimates when they are due."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from tracking.filters.clear_estimate import clear_estimate, has_recent_range
from tracking.filters.first_ranges import collect
from tracking.filters.level_vehicle import direction, level
from tracking.filters.pair.bank import (
    drop_timed_out,
    monitor_reflection,
    prune_bank,
    refine_group,
    remove_node,
)
from tracking.filters.pair.dynamics import predict
from tracking.filters.pair.initialisation import try_join, try_start
from tracking.filters.pair.motion_constraints import (
    add_mean_velocity,
    apply_motion_constraints,
    note_heading,
)
from tracking.filters.pair.range_update import (
    TIE,
    advance_pair,
    is_aided,
    node_variance,
    range_update,
    surveyed_distance_update,
)
from tracking.filters.pair.state import FilterState
from tracking.kernels.jit import allocating_kernel, kernel, small_kernel
from tracking.measurements import ACCEL_NOISE
from tracking.models.nlos import power_evidence

# Integer values of `Kind` and `Status`, since kernels cannot use enums.
STATE, SURVEY, RANGE, LEAVE = 3, 4, 5, 6
ABSENT, STARTING, AMBIGUOUS, OK, LOST = 0, 1, 2, 3, 4


class Workspace(NamedTuple):
    """Preallocated arrays for intermediate results."""

    work: np.ndarray
    """Jacobian and its product with P, (2, 7)."""
    members: np.ndarray
    """Present nodes, (node)."""
    L: np.ndarray
    """Covariance of a pair and its Cholesky factor, (6, 6)."""
    W: np.ndarray
    """Weights of the MDS, (pair, 6, 6)."""
    A: np.ndarray
    """Normal equations of the MDS, (6 node, 6 node)."""
    y: np.ndarray
    """Right-hand side of the MDS, then its solution, (6 node)."""
    nu: np.ndarray
    """Change of position and velocity of a pair by the MDS, (6)."""


@allocating_kernel
def run_events(coefficients, layout, state, block, t_out, out):
    """Process the events of every environment in order.

    Args:
        coefficients: Constants (`make_coefficients`), (1).
        layout: Tables.
        state: FilterState, updated.
        block: Events: t, kind, i, j, antenna_i, antenna_j, values, has_power, valid;
            (env, event, ...).
        t_out: Times at which estimates are due, ascending, (env, time) [s]. An estimate
            includes every event up to and including its time.
        out: Arrays written: pos, vel, cov, q, has_q, age, nis, nlos, status; (env, time, ...).
    """
    t, kind, node_i, node_j, antenna_i, antenna_j, values, has_power, valid = block
    c = coefficients[0]
    n = state.nodes.shape[1]
    work = Workspace(
        np.zeros((2, 7)),
        np.zeros(n, np.int64),
        np.zeros((6, 6)),
        np.zeros((state.pairs.shape[1], 6, 6)),
        np.zeros((6 * n, 6 * n)),
        np.zeros(6 * n),
        np.zeros(6),
    )
    for e in range(t.shape[0]):
        s = FilterState(
            state.nodes[e],
            state.held[e],
            state.pairs[e],
            state.group[e],
            state.x[e],
            state.P[e],
            state.alive[e],
            state.loglik[e],
            state.nlos[e],
            state.mean_v[e],
            state.mean_cov[e],
        )
        o = 0
        for k in range(t.shape[1]):
            if not valid[e, k]:
                continue
            while o < t_out.shape[1] and t_out[e, o] < t[e, k]:
                write_estimate(c, s, t_out[e, o], e, o, out)
                o += 1
            i, j, what = node_i[e, k], node_j[e, k], kind[e, k]
            if what == STATE:
                process_attitude(c, s, layout, i, t[e, k], values, e, k)
            elif what in (RANGE, SURVEY):
                a_i, a_j = antenna_i[e, k], antenna_j[e, k]
                if i > j:
                    i, j, a_i, a_j = j, i, a_j, a_i
                distance = values[e, k, 0]
                is_survey = what == SURVEY
                evidence = 0.0
                if has_power[e, k]:
                    evidence = power_evidence(c, values[e, k, 1] - values[e, k, 2])
                if t[e, k] - s.group[0].t_check + TIE >= c.check_period:
                    supervise(c, s, layout, t[e, k])
                p, runs = process_range(s, layout, i, j, t[e, k])
                if not runs:
                    collect_initial_range(c, s, layout, i, j, p, t[e, k], distance, is_survey)
                else:
                    update_range(
                        c, s, layout, work, p, a_i, a_j, t[e, k], distance, evidence, is_survey
                    )
            elif what == LEAVE:
                remove_node(c, s, layout, i, t[e, k])
        while o < t_out.shape[1]:
            write_estimate(c, s, t_out[e, o], e, o, out)
            o += 1


@small_kernel
def process_attitude(c, s, layout, i, t, values, e, k):
    """Predict the pairs of node i to time t, then hold its new orientation and acceleration."""
    node = s.nodes[i]
    if node.present:
        for other in range(s.nodes.shape[0]):
            if other != i and s.nodes[other].present:
                advance_pair(c, s, layout.pair_index[i, other], t)
        add_mean_velocity(c, s, i, t)
    note_heading(c, node, t, values[e, k])
    for column in range(7):
        s.held[i, column] = values[e, k, column]
    if node.levelled:
        w, x, y, z = s.held[i, 0], s.held[i, 1], s.held[i, 2], s.held[i, 3]
        a0, a1 = level(w, x, y, z, s.held[i, 4], s.held[i, 5], s.held[i, 6], *direction(w, x, y, z))
        s.held[i, 4], s.held[i, 5] = a0, a1
    node.accel_noise = values[e, k, ACCEL_NOISE]
    node.t_state = t
    node.has_state = True


@small_kernel
def process_range(s, layout, i, j, t):
    """Record a range of nodes i and j; return their pair and whether its filters run."""
    node_i, node_j = s.nodes[i], s.nodes[j]
    node_i.seen, node_j.seen = True, True
    node_i.t_last_range, node_j.t_last_range = t, t
    return layout.pair_index[i, j], node_i.present and node_j.present


@small_kernel
def update_range(c, s, layout, work, p, a_i, a_j, t, distance, evidence, is_survey):
    """Update a running pair with a range or surveyed distance; refine the group if it is due."""
    group = s.group[0]
    advance_pair(c, s, p, t)
    if is_survey:
        surveyed_distance_update(c, s, p, distance, work.work)
        s.pairs[p].t_range, s.pairs[p].t_used = t, t
    else:
        range_update(c, s, layout, p, t, distance, evidence, a_i, a_j, work.work)
    if not c.use_mds or t - group.t_mds + TIE < c.mds_period:
        return
    for q in range(s.pairs.shape[0]):
        if s.nodes[s.pairs[q].i].present and s.nodes[s.pairs[q].j].present:
            advance_pair(c, s, q, t)
    group.t_mds = t
    refine_group(c, s, layout, work)
    if t - group.t_wheels + TIE >= c.wheel_period:
        apply_motion_constraints(c, s, layout, t, work.work)


@kernel
def collect_initial_range(c, s, layout, i, j, p, t, distance, is_survey):
    """Collect a range or surveyed distance of a pair without filters, i < j; start or join."""
    collect(c, s.pairs[p], t, distance, is_survey)
    if not s.group[0].started:
        try_start(c, s, layout, t)
        # Three nodes in space equal their mirror image: merging makes room for both sides of a 4th.
        prune_bank(c, s)
        return
    if not s.nodes[i].present:
        try_join(c, s, layout, i, t)
    if not s.nodes[j].present:
        try_join(c, s, layout, j, t)


@kernel
def supervise(c, s, layout, t):
    """Drop nodes that timed out and unlikely hypotheses; with MDS, monitor the reflection."""
    drop_timed_out(c, s, layout, t)
    prune_bank(c, s)
    if c.use_mds:
        monitor_reflection(c, s, layout)
    s.group[0].t_check = t


@small_kernel
def is_lost(c, pair, age):
    """True if the age [s] of the last range of a pair that was no outlier is above its limit."""
    return age > max(c.lost_after, c.missed_intervals * pair.interval)


@allocating_kernel
def write_estimate(c, s, t, e, o, out):
    """Write the best hypothesis, predicted to time t; the state does not change."""
    clear_estimate(e, o, out)
    pos, vel, cov, q_wb, has_q, age, nis, nlos, status = out
    h = s.group[0].best
    x, P = np.zeros((1, 1, 6)), np.zeros((1, 1, 6, 6))
    for n in range(s.nodes.shape[0]):
        has_q[e, o, n] = s.nodes[n].has_state
        for k in range(4):
            q_wb[e, o, n, k] = s.held[n, k]
    for p in range(s.pairs.shape[0]):
        pair = s.pairs[p]
        node_i, node_j = s.nodes[pair.i], s.nodes[pair.j]
        nis[e, o, p] = pair.nis
        if not (node_i.present and node_j.present):
            both = has_recent_range(c, node_i, t) and has_recent_range(c, node_j, t)
            status[e, o, p] = STARTING if both else ABSENT
            continue
        x[0, 0] = s.x[p, h, :6]
        P[0, 0] = s.P[p, h, :6, :6]
        nlos[e, o, p] = s.nlos[p, h]
        aided_i, aided_j = is_aided(c, node_i, t), is_aided(c, node_j, t)
        w_i, w_j = 1.0 if aided_i else 0.0, 1.0 if aided_j else 0.0
        predict(
            x,
            P,
            0,
            0,
            t - pair.t,
            w_j * s.held[pair.j, 4] - w_i * s.held[pair.i, 4],
            w_j * s.held[pair.j, 5] - w_i * s.held[pair.i, 5],
            w_j * s.held[pair.j, 6] - w_i * s.held[pair.i, 6],
            math.sqrt(node_variance(c, node_i, aided_i) + node_variance(c, node_j, aided_j)),
            c.d,
        )
        pos[e, o, p] = x[0, 0, :3]
        vel[e, o, p] = x[0, 0, 3:]
        cov[e, o, p] = P[0, 0]
        age[e, o, p] = t - pair.t_used
        if s.group[0].n_alive > 1:
            status[e, o, p] = AMBIGUOUS
        elif is_lost(c, pair, age[e, o, p]) and not (node_i.static and node_j.static):
            status[e, o, p] = LOST
        else:
            status[e, o, p] = OK
