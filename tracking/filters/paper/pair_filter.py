"""The EKF of one pair: prediction and correction, eq. (7) to (11) of the paper, in place.

`tests/tracking/paper_reference_ekf.py` has the same equations as matrices. The orientation q_ij of
the paper's state is a function of the inputs alone and never correlated with position and velocity:
it is reported from the inputs and has no states here. The algebra is that of the other pair filters
(`pair.dynamics`), with one hypothesis.
"""

from __future__ import annotations

import math

from tracking.filters.pair import dynamics
from tracking.kernels.jit import kernel

TINY = 1e-6
"""[m, m/s] Shorter vectors have no direction."""
POS, VEL = 0, 3
"""First elements of x_ij and v_ij in the state of a pair."""


@kernel
def predict(c, s, p, t, x, P):
    """Predict pair p, held in `x` and `P`, from its time to t with the controls of its nodes.

    Args:
        c: Constants.
        s: PaperState of one environment.
        p: Pair.
        t: Time [s].
        x: States, (pair, 1, 6), that of pair p written.
        P: Covariances, (pair, 1, 6, 6), that of pair p written.
    """
    i, j, dt = s.pairs[p].i, s.pairs[p].j, t - s.pairs[p].t
    node_i, node_j = s.nodes[i], s.nodes[j]
    w_i = 1.0 if t - node_i.t_imu <= c.imu_timeout else 0.0
    w_j = 1.0 if t - node_j.t_imu <= c.imu_timeout else 0.0
    a0 = w_j * s.accel[j, 0] - w_i * s.accel[i, 0]
    a1 = w_j * s.accel[j, 1] - w_i * s.accel[i, 1]
    a2 = w_j * s.accel[j, 2] - w_i * s.accel[i, 2]
    moving = (0.0 if node_i.static else 1.0) + (0.0 if node_j.static else 1.0)
    # The paper's noise is that of a step, not a density.
    psd = c.accel_std * math.sqrt(moving * max(dt, 0.0))
    dynamics.predict(x, P, p, 0, dt, a0, a1, a2, psd, c.d)


@kernel
def passes_gate(c, s, p, t, distance):
    """Return whether a range passes the gate; update running average and low-passed derivative."""
    pair = s.pairs[p]
    age = t - pair.t_range
    v0, v1, v2 = s.x[p, 0, VEL], s.x[p, 0, VEL + 1], s.x[p, 0, VEL + 2]
    speed = math.sqrt(v0 * v0 + v1 * v1 + v2 * v2)
    if abs(distance - pair.mean) > c.gate_floor + c.gate_gain * speed:
        pair.n_rejected += 1
        pair.in_a_row += 1
        if pair.in_a_row < c.gate_reset:
            return False
        pair.mean, pair.rate = distance, 0.0
    else:
        pair.mean += age / (c.gate_tau + age) * (distance - pair.mean)
        if age > 0.0:
            raw = (distance - pair.last) / age
            pair.rate += age / (c.speed_tau + age) * (raw - pair.rate)
    pair.in_a_row = 0
    pair.last, pair.t_range = distance, t
    return True


@kernel
def correct(c, s, p, distance, work):
    """Correct pair p with a range and its derivative, whose errors are independent.

    Args:
        c: Constants.
        s: PaperState of one environment.
        p: Pair.
        distance: The range [m]; the derivative is that of the pair.
        work: Rows 0 and 1 as in `dynamics.correct`; row 2 has the derivatives of the speed, row 3
            the state before the update; (4, 6).

    Returns:
        Squared innovation of the range over its variance.
    """
    x, rate = s.x[p, 0], s.pairs[p].rate
    d = math.sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2])
    speed = math.sqrt(x[3] * x[3] + x[4] * x[4] + x[5] * x[5])
    along = (x[0] * x[3] + x[1] * x[4] + x[2] * x[5]) / d if d > TINY else 0.0
    for a in range(3):
        u = x[a] / d if d > TINY else 0.0
        work[0, POS + a], work[0, VEL + a] = u, 0.0
        if c.speed_is_norm:
            work[2, POS + a] = 0.0
            work[2, VEL + a] = x[VEL + a] / speed if speed > TINY else 0.0
        else:
            work[2, POS + a] = (x[VEL + a] - u * along) / d if d > TINY else 0.0
            work[2, VEL + a] = u
        work[3, POS + a], work[3, VEL + a] = x[POS + a], x[VEL + a]
    nu_d = distance - d
    nu_v = abs(rate) - speed if c.speed_is_norm else rate - along
    S = dynamics.correct(s.x, s.P, p, 0, work, nu_d, c.range_std * c.range_std)
    for a in range(6):
        work[0, a] = work[2, a]
        nu_v -= work[2, a] * (x[a] - work[3, a])
    dynamics.correct(s.x, s.P, p, 0, work, nu_v, c.speed_std * c.speed_std)
    return nu_d * nu_d / S


@kernel
def correct_position(s, p, pos, d, variance, work):
    """Correct pair p with a measured position, one axis after the other.

    Args:
        s: PaperState of one environment.
        p: Pair.
        pos: Measured position, (3) [m].
        d: 2 or 3.
        variance: Variance of the measurement along each axis [m2].
        work: Rows 0 and 1 as in `dynamics.correct`, (4, 6).
    """
    for k in range(d):
        work[0, :] = 0.0
        work[0, k] = 1.0
        dynamics.correct(s.x, s.P, p, 0, work, pos[k] - s.x[p, 0, k], variance)
