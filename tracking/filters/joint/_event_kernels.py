"""The loop over events: one pass in time order, estimates written where they are due."""

from __future__ import annotations

from tracking.jit import kernel, small_kernel
from tracking.filters._shape_kernels import collect
from tracking.filters.joint._alignment_kernels import NONE, STATIC, is_linear
from tracking.filters.joint._antenna_kernels import antenna_offset
from tracking.filters.joint._bank_kernels import (
    bank_range,
    prune_bank,
    remove_node,
    remove_silent,
    watch_mirror,
    watch_rotation,
)
from tracking.filters.joint._carrier_kernels import apply_carriers, centre
from tracking.filters.joint._cut_off_kernels import doubt_acceleration
from tracking.filters.joint._doubt_kernels import note_fit, watch_nodes
from tracking.filters.joint._estimate_kernels import write_estimate
from tracking.filters.joint._frame_kernels import watch_turns
from tracking.filters.joint._linear_kernels import settle_all
from tracking.filters.joint._misplaced_kernels import watch_places
from tracking.filters.joint._motion_kernels import moves, predict
from tracking.filters.joint._open_kernels import carry_slope
from tracking.filters.joint._range_kernels import fuse_range
from tracking.filters.joint._rest_kernels import learn_at_rest
from tracking.filters.joint._rotation_kernels import carry_moves, follow_rotation
from tracking.filters.joint._sample_kernels import sum_inertial, take_state
from tracking.filters.joint._sight_kernels import gap_evidence
from tracking.filters.joint._silence_kernels import (
    note_heard,
    note_interval,
    remove_faded,
    was_silent,
)
from tracking.filters.joint._sleep_kernels import may_move, none_moved, wake_up
from tracking.filters.joint._start_kernels import try_join, try_start
from tracking.filters.joint._stuck_kernels import is_stuck
from tracking.filters.joint._survey_kernels import fuse_survey, use_surveys
from tracking.filters.joint._turn_kernels import note_turn
from tracking.filters.joint.state import N_PRE, JointState

# Plain numbers of `Kind`: kernels do not know enums.
STATE, SURVEY, RANGE, LEAVE = 3, 4, 5, 6
SAME = 1e-5
"""[s] Ranges of one message differ by their rounding only: they share a prediction."""
GAUGE_PERIOD = 1.0
"""[s] Time between two moves of the centre to the origin."""


@kernel
def run_events(coefficients, layout, state, scratch, block, t_out, out):
    """Handle the events of every environment in order.

    Args:
        coefficients: COEFFICIENTS, (1).
        layout: Tables.
        state: JointState, updated.
        scratch: Room.
        block: Events: t, kind, i, j, antenna_i, antenna_j, values, has_power, valid;
            (env, event, ...).
        t_out: Times at which estimates are due, ascending, (env, time) [s]. An estimate
            holds every event up to its time, that time included.
        out: Arrays written: pos, vel, cov, q, has_q, age, nis, nlos, status; (env, time, ...).
    """
    t, kind, node_i, node_j, antenna_i, antenna_j, values, has_power, valid = block
    c = coefficients[0]
    for e in range(t.shape[0]):
        s = one_env(state, e)
        o = 0
        for k in range(t.shape[1]):
            if not valid[e, k]:
                continue
            while o < t_out.shape[1] and t_out[e, o] < t[e, k]:
                write_estimate(c, s, scratch, t_out[e, o], e, o, out)
                o += 1
            i, j, what = node_i[e, k], node_j[e, k], kind[e, k]
            if what == STATE:
                doubt_acceleration(c, s.nodes[i], s.pre, i, t[e, k], values[e, k, 7])
                take_state(c, s.nodes, s.held, s.pre, i, t[e, k], values, e, k)
            elif what in (RANGE, SURVEY):
                a_i, a_j = antenna_i[e, k], antenna_j[e, k]
                if i > j:
                    i, j, a_i, a_j = j, i, a_j, a_i
                sight = (0.0, c.enter_rate, c.leave_rate)
                if has_power[e, k]:
                    evidence = gap_evidence(c, values[e, k, 1] - values[e, k, 2])
                    sight = (evidence, c.enter_rate_with_power, c.leave_rate_with_power)
                is_survey, now, distance = what == SURVEY, t[e, k], values[e, k, 0]
                hear(c, s, layout, scratch, i, j, a_i, a_j, now, distance, sight, is_survey)
            elif what == LEAVE:
                settle_all(s)
                remove_node(c, s, layout, i)
        while o < t_out.shape[1]:
            write_estimate(c, s, scratch, t_out[e, o], e, o, out)
            o += 1


@kernel
def one_env(state, e):
    """The state of environment e; shares its memory."""
    return JointState(
        state.nodes[e],
        state.held[e],
        state.pre[e],
        state.pairs[e],
        state.group[e],
        state.x[e],
        state.P[e],
        state.waiting[e],
        state.n_waiting[e],
        state.moved[e],
        state.nlos[e],
        state.stays[e],
        state.alive[e],
        state.loglik[e],
        state.slope[e],
        state.score[e],
        state.information[e],
        state.spread[e],
    )


@kernel
def advance_all(coefficients, layout, state, scratch, t):
    """Carry every environment to its time t, (env) [s]."""
    for e in range(t.shape[0]):
        s = one_env(state, e)
        if s.group[0].alignment != NONE:
            advance(coefficients[0], s, layout, scratch, t[e], True)
            settle_all(s)


@small_kernel
def hear(c, s, layout, scratch, i, j, a_i, a_j, t, distance, sight, is_survey):
    """A range or survey between nodes i < j."""
    p = layout.pair_index[i, j]
    if not is_survey and is_stuck(c, s, p, t, distance):
        return
    node_i, node_j = s.nodes[i], s.nodes[j]
    if s.group[0].alignment != NONE and t - s.group[0].t_check > c.leave_after:
        # Nobody was heard: whoever speaks first has been away as long as the others.
        settle_all(s)
        remove_silent(c, s, layout, t)
    if s.group[0].alignment != NONE and (was_silent(c, node_i, t) or was_silent(c, node_j, t)):
        advance(c, s, layout, scratch, t, True)
        settle_all(s)
        remove_faded(c, s, layout, t)
    note_heard(c, node_i, t)
    note_heard(c, node_j, t)
    if not is_survey:
        node_i.antenna, node_j.antenna = a_i, a_j
    runs = node_i.present and node_j.present
    if s.group[0].alignment != NONE:
        advance(c, s, layout, scratch, t, not runs)
        for k in (i, j):
            if moves(s.nodes[k]):
                sum_inertial(c, s.nodes, s.held, s.pre, k, t)
        if t - s.group[0].t_check + SAME >= c.check_period:
            look_at_group(c, s, layout, t)
    if node_i.present and node_j.present:
        take_range(c, s, layout, scratch, p, a_i, a_j, t, distance, sight, is_survey)
    else:
        take_first_range(c, s, layout, scratch, i, j, p, t, distance, sight, is_survey)


@small_kernel
def advance(c, s, layout, scratch, t, at_once):
    """Carry every hypothesis to time t, and use what is known about the carriers.

    Carrying a covariance costs more than a range does. So unless it has to be `at_once`, the states
    stay where they are for a while, and ranges tell of them by what happened since
    (`_range_kernels.range_model`): only the noise of so short a time comes after them, not before.
    """
    group = s.group[0]
    if group.alignment == STATIC and not none_moved(c, s, t):
        settle_all(s)
        wake_up(c, s, layout, scratch)
    carriers_due = t - group.t_carrier + SAME >= c.carrier_period
    since = t - group.t
    if since > SAME and (at_once or carriers_due or since + SAME >= c.carry_period):
        carry(c, s, scratch, t)
    if carriers_due:
        first, end = bank_range(s)
        for h in range(first, end):
            if s.alive[h]:
                apply_carriers(c, s, h, t, t - group.t_carrier, scratch)
        group.t_carrier = t
    if t - group.t_gauge + SAME >= GAUGE_PERIOD:
        first, end = bank_range(s)
        for h in range(first, end):
            if s.alive[h]:
                centre(c, s, h, scratch.w)
        group.t_gauge = t


@small_kernel
def carry(c, s, scratch, t):
    """Carry every hypothesis to time t."""
    group = s.group[0]
    for i in range(s.nodes.shape[0]):
        if moves(s.nodes[i]):
            sum_inertial(c, s.nodes, s.held, s.pre, i, t)
    first, end = bank_range(s)
    for h in range(first, end):
        if s.alive[h]:
            follow_rotation(c, s, h, scratch)
            carry_moves(c, s, h)
            predict(c, s, h, t - group.t, scratch)
            if is_linear(group):
                carry_slope(c, s, h, scratch)
            for i in range(s.nodes.shape[0]):
                if moves(s.nodes[i]) and s.nodes[i].told:
                    learn_at_rest(s, h, i, scratch)
            s.stays[h, :] = 1.0
    for i in range(s.nodes.shape[0]):
        for k in range(N_PRE):
            s.pre[i, k] = 0.0
    group.t = t


@small_kernel
def take_range(c, s, layout, scratch, p, a_i, a_j, t, distance, sight, is_survey):
    """A range or survey of a running pair, at most `carry_period` after the states."""
    pair, group = s.pairs[p], s.group[0]
    i0, i1, i2 = antenna_offset(s.held, layout, pair.i, a_i)
    j0, j1, j2 = antenna_offset(s.held, layout, pair.j, a_j)
    levers = (i0, i1, i2, j0, j1, j2)
    dt, is_news = max(t - pair.t_range, 0.0), False
    if is_survey:
        pair.t_range, pair.t_used, is_news = t, t, distance != pair.surveyed
        collect(c, pair, t, distance, True)  # for when one of them comes again
    first, end = bank_range(s)
    for h in range(first, end):
        if not s.alive[h]:
            continue
        if is_survey:
            fuse_survey(c, s, h, p, distance, is_news, scratch)
            continue
        nu, misfit, nis, weight = fuse_range(c, s, h, p, dt, distance, levers, sight, scratch)
        if h == group.best:
            pair.nis = nis
            capped = min(misfit, 25.0) if weight > 0.5 else 25.0
            pair.misfit += 0.05 * (capped - pair.misfit)
            fits = 1.0 if weight > 0.5 and misfit < 6.0 else 0.0
            note_fit(c, s, p, dt, distance, fits, nu)
            if not (s.nodes[pair.i].doubted or s.nodes[pair.j].doubted):
                group.misfit += 0.01 * (weight * capped - group.misfit)
            if weight > 0.5:
                group.nis_sum += nis
                group.nis_n += 1
                pair.t_used = t
            else:
                pair.n_rejected += 1
    note_interval(c, pair, dt)
    pair.t_range = t
    pair.n_ranges += 1


@kernel
def take_first_range(c, s, layout, scratch, i, j, p, t, distance, sight, is_survey):
    """A range or survey of a pair that does not run yet, i < j."""
    collect(c, s.pairs[p], t, distance, is_survey)
    if s.pairs[p].start_n <= 1:
        s.pairs[p].start_sight = 0.0
    if not is_survey:
        s.pairs[p].start_sight += sight[0]
    settle_all(s)
    if s.group[0].alignment == NONE:
        if try_start(c, s, layout, t):
            for a in range(s.nodes.shape[0]):
                use_surveys(c, s, layout, scratch, a, a)
        return
    if s.group[0].alignment == STATIC and may_move(c, s, t):
        return
    for new in (i, j):
        if not s.nodes[new].present and try_join(c, s, layout, new, t):
            use_surveys(c, s, layout, scratch, new, s.nodes.shape[0])


@kernel
def look_at_group(c, s, layout, t):
    """From time to time: who left, and which hypotheses are worth their time."""
    settle_all(s)
    remove_silent(c, s, layout, t)
    if is_linear(s.group[0]):
        watch_turns(c, s, layout)
    prune_bank(c, s)
    note_turn(c, s)
    watch_mirror(c, s)
    watch_rotation(c, s, layout, t - s.group[0].t_check)
    watch_places(c, s, layout, t)
    watch_nodes(c, s, layout, t)
    s.group[0].t_check = t
