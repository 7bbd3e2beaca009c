"""Range update of a running pair: prediction, outlier gate and corrections."""

from __future__ import annotations

import math

from tracking.filters.pair.dynamics import (
    correct,
    predict,
    predict_range,
)
from tracking.filters.pair.nlos_model import (
    E,
    decay_range_error,
    reset_bias_on_transition,
    update_nlos_posterior,
)
from tracking.kernels.jit import kernel, small_kernel
from tracking.models.lever_arm import antenna_offset

TIE = 1e-6
"""[s] Times that differ by less are equal, whatever the origin of the clock."""


@small_kernel
def is_aided(c, node, t):
    """True if the last IMU sample of a node is no older than `imu_timeout`."""
    return node.has_state and t - node.t_state <= c.imu_timeout


@small_kernel
def advance_pair(c, s, p, t):
    """Predict pair p of every hypothesis to time t."""
    pair = s.pairs[p]
    dt = t - pair.t
    if dt <= 0.0:
        return
    i, j = pair.i, pair.j
    aided_i, aided_j = is_aided(c, s.nodes[i], t), is_aided(c, s.nodes[j], t)
    q = node_variance(c, s.nodes[i], aided_i) + node_variance(c, s.nodes[j], aided_j)
    w_i, w_j = 1.0 if aided_i else 0.0, 1.0 if aided_j else 0.0
    a0 = w_j * s.held[j, 4] - w_i * s.held[i, 4]
    a1 = w_j * s.held[j, 5] - w_i * s.held[i, 5]
    a2 = w_j * s.held[j, 6] - w_i * s.held[i, 6]
    psd = math.sqrt(q)
    group = s.group[0]
    first, end = (0, s.alive.shape[0]) if group.n_alive > 1 else (group.best, group.best + 1)
    for h in range(first, end):
        if s.alive[h]:
            predict(s.x, s.P, p, h, dt, a0, a1, a2, psd, c.d)
    pair.t = t


@small_kernel
def node_variance(c, node, aided):
    """Return the squared acceleration noise density of a node [m2/s4/Hz]."""
    if node.static:
        return 0.0
    if not aided:
        return c.unaided_accel_psd * c.unaided_accel_psd
    return node.psd * node.psd + node.accel_noise * node.accel_noise


@small_kernel
def passes_gate(c, s, p, t, distance):
    """Return whether a range passes the outlier gate of the paper; update the running average.

    The allowed difference grows with the relative speed and with the age of the average, so
    that the first range after a gap passes.
    """
    pair = s.pairs[p]
    if pair.n_ranges == 0:
        pair.mean_distance = distance
        pair.in_a_row = 0
        return True
    age = t - pair.t_range
    b = s.group[0].best
    v0, v1, v2 = s.x[p, b, 3], s.x[p, b, 4], s.x[p, b, 5]
    speed = math.sqrt(v0 * v0 + v1 * v1 + v2 * v2)
    lag = c.gate_tau + age
    allowed = c.gate_floor + c.gate_speed_gain * max(speed, c.gate_min_speed) * lag
    jump = distance - pair.mean_distance
    if abs(jump) > allowed:
        pair.n_rejected += 1
        pair.in_a_row += 1
        if pair.in_a_row < c.gate_max_rejected:
            return False
        pair.mean_distance = distance
    else:
        pair.mean_distance += jump * age / lag
    pair.in_a_row = 0
    return True


@kernel
def surveyed_distance_update(c, s, p, distance, work):
    """Correct pair p of every hypothesis with a surveyed distance."""
    for h in range(s.alive.shape[0]):
        if s.alive[h]:
            nu = distance - predict_range(s.x, p, h, 0.0, 0.0, 0.0, work)
            correct(s.x, s.P, p, h, work, nu, c.survey_var)


@small_kernel
def range_update(c, s, layout, p, t, distance, evidence, antenna_i, antenna_j, work):
    """Gate a range, then correct pair p of every hypothesis with it."""
    if not passes_gate(c, s, p, t, distance):
        return
    pair = s.pairs[p]
    i0, i1, i2 = antenna_offset(s.held, layout, pair.i, antenna_i)
    j0, j1, j2 = antenna_offset(s.held, layout, pair.j, antenna_j)
    l0, l1, l2 = j0 - i0, j1 - i1, j2 - i2
    dt = max(t - pair.t_range, 0.0)
    group = s.group[0]
    many = group.n_alive > 1
    first, end = (0, s.alive.shape[0]) if many else (group.best, group.best + 1)
    for h in range(first, end):
        if not s.alive[h]:
            continue
        decay_range_error(c, s, p, h, dt)
        nu = distance - predict_range(s.x, p, h, l0, l1, l2, work)
        variance, w_e = predicted_variance(s.P, p, h, work)
        expected = variance + c.range_var
        misfit = nu * nu / expected
        switched, sane, loglik = update_nlos_posterior(c, s, p, h, dt, nu, variance, w_e, evidence)
        nu += s.x[p, h, E]
        reset_bias_on_transition(c, s, p, h, switched)
        nu -= s.x[p, h, E]
        R = c.range_var + s.nlos[p, h] * c.nlos_white_var
        variance, _ = predicted_variance(s.P, p, h, work)
        nis = nu * nu / (variance + R)
        if sane > c.least_trust:
            correct(s.x, s.P, p, h, work, nu, R / sane)
        s.loglik[h] += c.likelihood_tempering * max(loglik, -0.5 * (c.nis_cap + math.log(expected)))
        if h == group.best:
            pair.nis = nis
            group.nis_sum += nis
            group.nis_n += 1
            group.misfit += c.misfit_gain * (sane * min(misfit, c.largest_nis) - group.misfit)
            if sane > c.least_sane:
                pair.t_used = t
    if dt > TIE:
        pair.interval += c.interval_gain * (min(dt, c.node_timeout) - pair.interval)
    pair.t_range = t
    pair.n_ranges += 1


@small_kernel
def predicted_variance(P, p, h, work):
    """Return the variance of a predicted range and its covariance with the slow error [m2]."""
    variance, w_e = 0.0, 0.0
    for r in range(P.shape[2]):
        total = 0.0
        for k in range(P.shape[2]):
            total += P[p, h, r, k] * work[0, k]
        variance += work[0, r] * total
        w_e = total
    return variance, w_e
