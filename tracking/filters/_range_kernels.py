"""A range in a running pair: dead reckoning up to it, the outlier gate, the corrections."""

from __future__ import annotations

import numpy as np
from tracking.compiled import kernel

from tracking.filters._pair_kernels import (
    correct,
    predict,
    range_model,
    range_rate_model,
    speed_model,
)

LN_2PI = float(np.log(2.0 * np.pi))


@kernel
def node_psd(c, nodes, e, n, t):
    """Acceleration noise that a node adds now, and whether its IMU is heard."""
    if c.is_static[n]:
        return 0.0, False
    if nodes.has_state[e, n] and t - nodes.t_state[e, n] <= c.unaided_after:
        return c.accel_psd[n], True
    return c.unaided_psd, False


@kernel
def advance_pair(c, nodes, pairs, bank, e, p, t):
    """Predict pair p of every hypothesis to time t."""
    dt = t - pairs.t[e, p]
    if dt <= 0.0:
        return
    i, j = c.pairs[p, 0], c.pairs[p, 1]
    psd_i, aided_i = node_psd(c, nodes, e, i, t)
    psd_j, aided_j = node_psd(c, nodes, e, j, t)
    psd = np.sqrt(psd_i * psd_i + psd_j * psd_j)
    a_i, a_j = np.zeros(3), np.zeros(3)
    for k in range(3):
        if aided_i:
            a_i[k] = nodes.accel_w[e, i, k]
        if aided_j:
            a_j[k] = nodes.accel_w[e, j, k]
    for h in range(bank.alive.shape[1]):
        if bank.alive[e, h]:
            predict(pairs.x[e, h, p], pairs.P[e, h, p], dt, a_i, a_j, psd, c.d)
    pairs.t[e, p] = t


@kernel
def lever_arm(c, nodes, e, i, j, antenna_i, antenna_j, lever):
    """offset_j - offset_i of two antennas in the world frame, written to lever [m]."""
    for k in range(3):
        lever[k] = 0.0
    for side in range(2):
        n, antenna, sign = (j, antenna_j, 1.0) if side else (i, antenna_i, -1.0)
        w, x, y, z = nodes.q_wb[e, n]
        o0, o1, o2 = c.antenna_b[antenna]
        # v + 2 w (u x v) + 2 u x (u x v), with u the vector part
        c0, c1, c2 = y * o2 - z * o1, z * o0 - x * o2, x * o1 - y * o0
        lever[0] += sign * (o0 + 2.0 * (w * c0 + y * c2 - z * c1))
        lever[1] += sign * (o1 + 2.0 * (w * c1 + z * c0 - x * c2))
        lever[2] += sign * (o2 + 2.0 * (w * c2 + x * c1 - y * c0))


@kernel
def passes_gate(c, pairs, bank, e, p, t, distance):
    """The outlier gate of the paper; updates the running average.

    The allowed variation grows with the relative speed and with the age of the average, so
    that a node that was silent and came back passes.
    """
    if pairs.n_ranges[e, p] == 0:
        pairs.mean_distance[e, p] = distance
        pairs.in_a_row[e, p] = 0
        return True
    age = t - pairs.t_range[e, p]
    x = pairs.x[e, bank.best[e], p]
    speed = np.sqrt(x[3] * x[3] + x[4] * x[4] + x[5] * x[5])
    lag = c.gate_tau + age
    allowed = c.gate_floor + c.gate_speed_gain * max(speed, c.gate_min_speed) * lag
    jump = distance - pairs.mean_distance[e, p]
    if abs(jump) > allowed:
        pairs.n_rejected[e, p] += 1
        pairs.in_a_row[e, p] += 1
        if pairs.in_a_row[e, p] < c.gate_max_rejected:
            return False
        pairs.mean_distance[e, p] = distance
    else:
        pairs.mean_distance[e, p] += jump * age / lag
    pairs.in_a_row[e, p] = 0
    return True


@kernel
def fuse_survey(c, pairs, bank, e, p, distance):
    """Correct pair p of every hypothesis with a surveyed distance."""
    H, lever = np.empty(6), np.zeros(3)
    for h in range(bank.alive.shape[1]):
        if bank.alive[e, h]:
            x = pairs.x[e, h, p]
            nu = distance - range_model(x, lever, H)
            correct(x, pairs.P[e, h, p], H, nu, c.survey_var, c.d)


@kernel
def fuse_range(c, nodes, pairs, bank, e, p, t, distance, antenna_i, antenna_j):
    """Gate a range, then correct pair p of every hypothesis with it and with its rate."""
    if not passes_gate(c, pairs, bank, e, p, t, distance):
        return False
    lever, H = np.empty(3), np.empty(6)
    lever_arm(c, nodes, e, c.pairs[p, 0], c.pairs[p, 1], antenna_i, antenna_j, lever)
    age = t - pairs.t_range[e, p]
    has_rate = pairs.n_ranges[e, p] > 0 and 0.0 < age < 3.0 * c.speed_tau
    if has_rate:
        raw = (distance - pairs.last_distance[e, p]) / age
        pairs.rate[e, p] += age / (c.speed_tau + age) * (raw - pairs.rate[e, p])
    elif age > 0.0:
        pairs.rate[e, p] = 0.0
        pairs.n_ranges[e, p] = 0
    has_rate = has_rate and pairs.n_ranges[e, p] * age > 2.0 * c.speed_tau
    for h in range(bank.alive.shape[1]):
        if not bank.alive[e, h]:
            continue
        x, P = pairs.x[e, h, p], pairs.P[e, h, p]
        nu = distance - range_model(x, lever, H)
        nis = correct(x, P, H, nu, c.range_var, c.d)
        S = nu * nu / max(nis, 1e-12) if nu != 0.0 else c.range_var
        bank.loglik[e, h] -= 0.5 * (min(nis, c.max_nis) + np.log(S) + LN_2PI)
        if h == bank.best[e]:
            pairs.nis[e, p] = nis
            bank.nis_sum[e] += nis
            bank.nis_n[e] += 1
        if has_rate and c.speed_model == 1:
            nu = pairs.rate[e, p] - range_rate_model(x, lever, H)
            correct(x, P, H, nu, c.speed_var, c.d)
        elif has_rate and c.speed_model == 2:
            nu = abs(pairs.rate[e, p]) - speed_model(x, H)
            correct(x, P, H, nu, c.speed_var, c.d)
    pairs.last_distance[e, p] = distance
    pairs.t_range[e, p] = t
    pairs.n_ranges[e, p] += 1
    return True
