"""Event loop: one pass in time order, with estimates written when they are due."""

from __future__ import annotations

from tracking.filters.first_ranges import collect
from tracking.filters.joint.ekf.gauge import centre
from tracking.filters.joint.ekf.observability import enforce_observability, propagate_corrections
from tracking.filters.joint.ekf.preintegration import preintegrate, process_attitude
from tracking.filters.joint.ekf.propagation import moves, predict
from tracking.filters.joint.ekf.workspace import (
    DONE,
    ENV,
    EVENT,
    JOIN,
    JOIN_OTHER,
    NODE,
    NOTHING,
    OUT,
    REINITIALISE,
    REMOVE,
    SPAWN,
    STALE,
    START,
    SUPERVISED,
    TIME_OUT,
)
from tracking.filters.joint.estimate import write_estimate
from tracking.filters.joint.hypotheses.alignment import NONE, STATIC, is_linear
from tracking.filters.joint.hypotheses.alignment_sensitivity import propagate_sensitivity
from tracking.filters.joint.hypotheses.bank import flush_all_updates
from tracking.filters.joint.hypotheses.initialisation import can_join, can_start
from tracking.filters.joint.hypotheses.static_initialisation import all_static, may_move
from tracking.filters.joint.state import one_env
from tracking.filters.joint.supervision.missing_ranges import (
    SAME,
    is_frozen,
    is_silent,
    note_seen,
    update_interval,
)
from tracking.filters.joint.supervision.residuals import update_residuals
from tracking.filters.joint.supervision.supervise import supervise
from tracking.filters.joint.updates.motion_constraints import (
    apply_motion_constraints,
    update_gyro_bias_at_rest,
)
from tracking.filters.joint.updates.range_update import range_update
from tracking.filters.joint.updates.surveyed_distance import surveyed_distance_update
from tracking.kernels.addresses import by_reference
from tracking.kernels.jit import kernel, small_kernel
from tracking.models.lever_arm import antenna_offset
from tracking.models.nlos import power_evidence

# Plain numbers of `Kind`: kernels do not know enums.
STATE, SURVEY, RANGE, LEAVE = 3, 4, 5, 6


@kernel
def run_events(coefficients, layout, state, work, block, t_out, out):
    """Process the events of every environment in order.

    Args:
        coefficients: Constants (`make_coefficients`), (1).
        layout: Tables.
        state: JointState, updated.
        work: Workspace.
        block: Events: t, kind, i, j, antenna_i, antenna_j, values, has_power, valid;
            (env, event, ...).
        t_out: Times at which estimates are due, ascending, (env, time) [s]. An estimate
            holds every event up to its time, that time included.
        out: Arrays written: pos, vel, cov, q, has_q, age, nis, nlos, status; (env, time, ...).

    Returns:
        Action that is due before the next call, see `rare`.
    """
    t, kind, node_i, node_j, antenna_i, antenna_j, values, has_power, valid = block
    c, cursor = coefficients[0], work.cursor
    layout, work = by_reference(layout), by_reference(work)
    for e in range(cursor[ENV], t.shape[0]):
        s, o = by_reference(one_env(state, e)), cursor[OUT]
        for k in range(cursor[EVENT], t.shape[1]):
            if not valid[e, k]:
                continue
            while o < t_out.shape[1] and t_out[e, o] < t[e, k]:
                write_estimate(c, s, work, t_out[e, o], e, o, out)
                o += 1
            i, j, what, action = node_i[e, k], node_j[e, k], kind[e, k], NOTHING
            if what == STATE:
                process_attitude(
                    c, s.nodes, s.last_attitude_accel, s.preintegrated, i, t[e, k], values, e, k
                )
            elif what in (RANGE, SURVEY):
                a_i, a_j = antenna_i[e, k], antenna_j[e, k]
                if i > j:
                    i, j, a_i, a_j = j, i, a_j, a_i
                sight = (0.0, c.los_to_nlos_rate, c.nlos_to_los_rate)
                if has_power[e, k]:
                    evidence = power_evidence(c, values[e, k, 1] - values[e, k, 2])
                    sight = (evidence, c.los_to_nlos_rate_with_power, c.nlos_to_los_rate_with_power)
                is_survey, now, distance = what == SURVEY, t[e, k], values[e, k, 0]
                action = process_range(
                    c, s, layout, work, i, j, a_i, a_j, now, distance, sight, is_survey
                )
            elif what == LEAVE and cursor[DONE] != REMOVE:
                cursor[NODE], action = i, REMOVE
            cursor[DONE] = action
            if action != NOTHING:
                flush_all_updates(s)  # rare kernels find no pending updates
                cursor[ENV], cursor[EVENT], cursor[OUT] = e, k, o
                return action
        while o < t_out.shape[1]:
            write_estimate(c, s, work, t_out[e, o], e, o, out)
            o += 1
        cursor[EVENT], cursor[OUT] = 0, 0
    return NOTHING


@kernel
def predict_all(coefficients, state, work, t):
    """Predict every environment to its time t, (env) [s]."""
    for e in range(t.shape[0]):
        s = by_reference(one_env(state, e))
        if s.group[0].alignment != NONE:
            predict_to(coefficients[0], s, work, t[e], True)
            flush_all_updates(s)


@kernel
def process_range(c, s, layout, work, i, j, a_i, a_j, t, distance, sight, is_survey):
    """Process a range or survey between nodes i < j; return the action that is due (`rare`).

    It is called again after that action, and continues: `work.cursor` has the last action done.
    """
    done, group = work.cursor[DONE], s.group[0]
    p = layout.pair_index[i, j]
    if done == NOTHING and not is_survey and is_frozen(c, s, p, t, distance):
        return NOTHING
    node_i, node_j = s.nodes[i], s.nodes[j]
    if done < TIME_OUT and group.alignment != NONE and t - group.t_check > c.node_timeout:
        # After such a pause all nodes have timed out, before the first of them is seen again.
        return TIME_OUT
    if done < SPAWN and group.alignment == STATIC and not all_static(c, s, t):
        return SPAWN
    silent = is_silent(c, node_i, t) or is_silent(c, node_j, t)
    if done < STALE and group.alignment != NONE and silent:
        predict_to(c, s, work, t, True)
        return STALE
    if done <= STALE:
        note_seen(c, node_i, t)
        note_seen(c, node_j, t)
        if not is_survey:
            node_i.antenna, node_j.antenna = a_i, a_j
        if group.alignment != NONE:
            predict_to(c, s, work, t, not (node_i.present and node_j.present))
            for k in (i, j):
                if moves(s.nodes[k]):
                    preintegrate(c, s.nodes, s.last_attitude_accel, s.preintegrated, k, t)
            if t - group.t_check + SAME >= c.check_period:
                done = SUPERVISED
    if SUPERVISED <= done <= REINITIALISE:
        action = supervise(c, s, layout, work, t, done)
        if action != NOTHING:
            return action
    if done > REINITIALISE:
        return next_join(c, s, layout, work, i, j, t, done)
    if node_i.present and node_j.present:
        update_range(c, s, layout, work, p, a_i, a_j, t, distance, sight, is_survey)
        return NOTHING
    return collect_initial_range(c, s, layout, work, i, j, p, t, distance, sight, is_survey)


@small_kernel
def hypothesis_range(s):
    """Return first and end index of the hypotheses to loop over: all, or the only one."""
    group = s.group[0]
    if group.n_alive > 1:
        return 0, s.alive.shape[0]
    return group.best, group.best + 1


@kernel
def predict_to(c, s, work, t, at_once):
    """Predict every hypothesis to time t, and apply the motion constraints that are due.

    Propagation of a covariance costs more than a range. So unless it is needed `at_once`, the
    states stay at their time for a while, and ranges are predicted by the displacement since
    (`range_update.predict_range`): only process noise of that time comes after them, not before.
    """
    group = s.group[0]
    constraints_due = t - group.t_constraints + SAME >= c.constraint_period
    since = t - group.t
    if since > SAME and (at_once or constraints_due or since + SAME >= c.propagation_period):
        propagate(c, s, work, t)
    if constraints_due:
        first, end = hypothesis_range(s)
        for h in range(first, end):
            if s.alive[h]:
                apply_motion_constraints(c, s, h, t, t - group.t_constraints, work)
        group.t_constraints = t
    if t - group.t_gauge + SAME >= c.centre_period:
        first, end = hypothesis_range(s)
        for h in range(first, end):
            if s.alive[h]:
                centre(c, s, h, work.w)
        group.t_gauge = t


@kernel
def propagate(c, s, work, t):
    """Propagate every hypothesis to time t."""
    group = s.group[0]
    for i in range(s.nodes.shape[0]):
        if moves(s.nodes[i]):
            preintegrate(c, s.nodes, s.last_attitude_accel, s.preintegrated, i, t)
    first, end = hypothesis_range(s)
    for h in range(first, end):
        if s.alive[h]:
            enforce_observability(c, s, h, work)
            propagate_corrections(c, s, h)
            predict(c, s, h, t - group.t, work)
            if is_linear(group):
                propagate_sensitivity(c, s, h, work)
            for i in range(s.nodes.shape[0]):
                if moves(s.nodes[i]) and s.nodes[i].has_ahrs_feedback:
                    update_gyro_bias_at_rest(s, h, i, work)
            s.bias_retention[h, :] = 1.0
    for i in range(s.nodes.shape[0]):
        s.preintegrated[i, :] = 0.0
    group.t = t


@kernel
def update_range(c, s, layout, work, p, a_i, a_j, t, distance, sight, is_survey):
    """Correct a running pair with a range or survey, within `propagation_period` of the states."""
    pair, group = s.pairs[p], s.group[0]
    i0, i1, i2 = antenna_offset(s.last_attitude_accel, layout, pair.i, a_i)
    j0, j1, j2 = antenna_offset(s.last_attitude_accel, layout, pair.j, a_j)
    levers = (i0, i1, i2, j0, j1, j2)
    dt, is_news = max(t - pair.t_range, 0.0), False
    if is_survey:
        pair.t_range, pair.t_used, is_news = t, t, distance != pair.surveyed
        collect(c, pair, t, distance, True)  # for a later join of one of them
    first, end = hypothesis_range(s)
    for h in range(first, end):
        if not s.alive[h]:
            continue
        if is_survey:
            surveyed_distance_update(c, s, h, p, distance, is_news, work)
            continue
        nu, misfit, nis, weight, loglik = range_update(
            c, s, h, p, dt, distance, levers, sight, work
        )
        if h == group.best:
            group.loglik_sum += loglik
            group.loglik_n += 1
            pair.nis = nis
            update_residuals(c, s, p, dt, distance, nu, misfit, weight)
            if weight > c.least_sane:
                group.nis_sum += nis
                group.nis_n += 1
                pair.t_used = t
            else:
                pair.n_rejected += 1
    update_interval(c, pair, dt)
    pair.t_range = t
    pair.n_ranges += 1


@kernel
def collect_initial_range(c, s, layout, work, i, j, p, t, distance, sight, is_survey):
    """Collect a range or survey of a pair that does not run, i < j; return the action due."""
    collect(c, s.pairs[p], t, distance, is_survey)
    if s.pairs[p].start_n <= 1:
        s.pairs[p].start_nlos_llr = 0.0
    if not is_survey:
        s.pairs[p].start_nlos_llr += sight[0]
    if s.group[0].alignment == NONE:
        return START if can_start(c, s, layout, work.idx, t) > 0 else NOTHING
    if s.group[0].alignment == STATIC and may_move(c, s, t):
        return NOTHING
    return next_join(c, s, layout, work, i, j, t, NOTHING)


@kernel
def next_join(c, s, layout, work, i, j, t, done):
    """Return the join action of the first node of a range that can join, or `NOTHING`."""
    for new, action in ((i, JOIN), (j, JOIN_OTHER)):
        is_due = done < action and done != START and not s.nodes[new].present
        if is_due and can_join(c, s, layout, new, work.idx, t) > 0:
            work.cursor[NODE] = new
            return action
    return NOTHING
