"""The EKF of one pair: prediction and correction, eq. (7) to (11) of the paper, in place.

`tests/tracking/paper_reference_ekf.py` has the same equations as matrices. Position and velocity
are never correlated with the orientation, so the blocks of P are updated one by one.
"""

from __future__ import annotations

import math

from tracking.kernels.jit import kernel, small_kernel

TINY = 1e-6
"""[m, m/s] Shorter vectors have no direction."""

VELOCITY, ORIENTATION = 3, 6
"""First elements of v_ij and q_ij in the state of a pair."""


@kernel
def predict(c, s, p, t, x, P):
    """Predict pair p, held in `x` and `P`, from its time to t with the controls of its nodes.

    Args:
        c: Constants.
        s: PaperState of one environment.
        p: Pair.
        t: Time [s].
        x: State, (10), written.
        P: Covariance, (10, 10), written.
    """
    i, j = s.pairs[p].i, s.pairs[p].j
    dt = t - s.pairs[p].t
    relative_orientation(s.control, i, j, x)
    if dt <= 0.0:
        return
    node_i, node_j = s.nodes[i], s.nodes[j]
    w_i = 1.0 if t - node_i.t_imu <= c.imu_timeout else 0.0
    w_j = 1.0 if t - node_j.t_imu <= c.imu_timeout else 0.0
    moving = (0.0 if node_i.static else 1.0) + (0.0 if node_j.static else 1.0)
    q = moving * c.accel_std * c.accel_std
    half = 0.5 * dt * dt
    for a in range(c.d):
        accel = w_j * s.control[j, a] - w_i * s.control[i, a]
        x[a] += dt * x[VELOCITY + a] + half * accel
        x[VELOCITY + a] += dt * accel
    for a in range(c.d):
        for b in range(c.d):
            P[a, b] += dt * (P[a, VELOCITY + b] + P[VELOCITY + a, b])
            P[a, b] += dt * dt * P[VELOCITY + a, VELOCITY + b]
    for a in range(c.d):
        for b in range(c.d):
            P[a, VELOCITY + b] += dt * P[VELOCITY + a, VELOCITY + b]
    for a in range(c.d):
        for b in range(c.d):
            P[VELOCITY + b, a] = P[a, VELOCITY + b]
    for a in range(c.d):
        P[a, a] += half * half * q
        P[a, VELOCITY + a] += half * dt * q
        P[VELOCITY + a, a] += half * dt * q
        P[VELOCITY + a, VELOCITY + a] += dt * dt * q
    # W_q (sigma^2 1) W_q^T: the derivatives of a product of unit quaternions are orthogonal.
    q = moving * c.orientation_std * c.orientation_std
    for a in range(4):
        for b in range(4):
            P[ORIENTATION + a, ORIENTATION + b] = q if a == b else 0.0


@small_kernel
def relative_orientation(control, i, j, x):
    """Write ``q_ij = q_i^-1 q_j`` into a state."""
    w, u, v, z = control[i, 3], -control[i, 4], -control[i, 5], -control[i, 6]
    a, b, c, d = control[j, 3], control[j, 4], control[j, 5], control[j, 6]
    x[ORIENTATION] = w * a - u * b - v * c - z * d
    x[ORIENTATION + 1] = w * b + u * a + v * d - z * c
    x[ORIENTATION + 2] = w * c - u * d + v * a + z * b
    x[ORIENTATION + 3] = w * d + u * c - v * b + z * a


@kernel
def passes_gate(c, s, p, t, distance):
    """Gate a range of pair p; update its running average and its low-passed derivative."""
    pair = s.pairs[p]
    age = t - pair.t_range
    x = s.x[p]
    speed = math.sqrt(x[3] * x[3] + x[4] * x[4] + x[5] * x[5])
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
def correct(c, s, p, distance, H, PH):
    """Correct pair p with a range and its derivative.

    Args:
        c: Constants.
        s: PaperState of one environment.
        p: Pair.
        distance: The range [m]; the derivative is that of the pair.
        H: Room, (2, 6).
        PH: Room, (6, 2).
    """
    x, P, rate = s.x[p], s.P[p], s.pairs[p].rate
    d = math.sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2])
    speed = math.sqrt(x[3] * x[3] + x[4] * x[4] + x[5] * x[5])
    x_v = x[0] * x[3] + x[1] * x[4] + x[2] * x[5]
    H[:, :] = 0.0
    for a in range(3):
        H[0, a] = x[a] / d if d > TINY else 0.0
    nu_d = distance - d
    if c.speed_is_norm:
        for a in range(3):
            H[1, VELOCITY + a] = x[VELOCITY + a] / speed if speed > TINY else 0.0
        nu_v = abs(rate) - speed
    else:
        along = x_v / d if d > TINY else 0.0
        for a in range(3):
            H[1, a] = (x[VELOCITY + a] - H[0, a] * along) / d if d > TINY else 0.0
            H[1, VELOCITY + a] = H[0, a]
        nu_v = rate - along
    S00, S01, S11 = c.range_std * c.range_std, 0.0, c.speed_std * c.speed_std
    for a in range(6):
        for row in range(2):
            total = 0.0
            for b in range(6):
                total += P[a, b] * H[row, b]
            PH[a, row] = total
    for a in range(6):
        S00 += H[0, a] * PH[a, 0]
        S01 += H[0, a] * PH[a, 1]
        S11 += H[1, a] * PH[a, 1]
    det = S00 * S11 - S01 * S01
    for a in range(6):
        k0 = (PH[a, 0] * S11 - PH[a, 1] * S01) / det
        k1 = (PH[a, 1] * S00 - PH[a, 0] * S01) / det
        x[a] += k0 * nu_d + k1 * nu_v
        for b in range(a, 6):
            value = P[a, b] - k0 * PH[b, 0] - k1 * PH[b, 1]
            P[a, b] = value
            P[b, a] = value
    return nu_d * nu_d / S00


@kernel
def update_position(x, P, pos, d, variance, K):
    """Correct a filter with a measurement of its position, one axis after the other.

    Args:
        x: State, (10), updated.
        P: Covariance, (10, 10), updated.
        pos: Measured position, (3) [m].
        d: 2 or 3.
        variance: Of the measurement along each axis [m2].
        K: Room, (6).
    """
    for k in range(d):
        S, nu = P[k, k] + variance, pos[k] - x[k]
        for a in range(6):
            K[a] = P[a, k]
        for a in range(6):
            x[a] += K[a] / S * nu
            for b in range(6):
                P[a, b] -= K[a] * K[b] / S


@small_kernel
def mean_orientation(q_sum, p, q):
    """Write the mean of a pair's first orientations, (4)."""
    squared = 0.0
    for a in range(4):
        squared += q_sum[p, a] * q_sum[p, a]
    length = math.sqrt(squared)
    for a in range(4):
        q[a] = q_sum[p, a] / length if length > 0.0 else (1.0 if a == 0 else 0.0)
