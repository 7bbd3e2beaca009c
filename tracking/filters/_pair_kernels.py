"""The Kalman filter of one pair: prediction and scalar corrections, in place.

State ``x = (pos_ij, vel_ij)``, six numbers, and covariance ``P``. In two dimensions the
vertical rows stay exactly zero: nothing is uncertain across the plane.
"""

from __future__ import annotations

import numpy as np
from tracking.compiled import kernel

MIN_DISTANCE = 0.01
"""[m] Closer than this a direction has no meaning and a range is not used."""


@kernel
def predict(x, P, dt, accel_i, accel_j, psd, d):
    """Dead reckoning over dt with constant accelerations.

    ``pos += dt vel + dt^2/2 a``, ``vel += dt a``, ``a = accel_j - accel_i``, and
    ``P = F P F^T + W (psd^2 / dt) W^T`` with ``W = (dt^2/2, dt)`` per axis, [1] eq. 8-9.
    """
    if dt <= 0.0:
        return
    half = 0.5 * dt * dt
    for k in range(d):
        a = accel_j[k] - accel_i[k]
        x[k] += dt * x[3 + k] + half * a
        x[3 + k] += dt * a
    for r in range(d):
        for c in range(r, d):
            p_vv = P[3 + r, 3 + c]
            p_xx = P[r, c] + dt * (P[r, 3 + c] + P[3 + r, c]) + dt * dt * p_vv
            P[r, c] = p_xx
            P[c, r] = p_xx
    for r in range(d):
        for c in range(d):
            p_xv = P[r, 3 + c] + dt * P[3 + r, 3 + c]
            P[r, 3 + c] = p_xv
            P[3 + c, r] = p_xv
    q = psd * psd
    for k in range(d):
        P[k, k] += 0.25 * q * dt * dt * dt
        P[k, 3 + k] += 0.5 * q * dt * dt
        P[3 + k, k] = P[k, 3 + k]
        P[3 + k, 3 + k] += q * dt


@kernel
def correct(x, P, H, nu, R, d):
    """Scalar Kalman update with innovation nu and row H, Joseph form; returns the NIS.

    ``P (I - KH)`` is expanded to ``P - K (PH)^T - (PH) K^T + K S K^T``, which keeps P
    symmetric and positive for every K.
    """
    PH = np.empty(6)
    S = R
    for r in range(6):
        s = 0.0
        for c in range(6):
            s += P[r, c] * H[c]
        PH[r] = s
        S += H[r] * s
    inv_S = 1.0 / S
    for r in range(6):
        x[r] += PH[r] * inv_S * nu
    for r in range(6):
        K_r = PH[r] * inv_S
        for c in range(r, 6):
            K_c = PH[c] * inv_S
            p = P[r, c] - K_r * PH[c] - PH[r] * K_c + K_r * S * K_c
            P[r, c] = p
            P[c, r] = p
    return nu * nu * inv_S


@kernel
def range_model(x, lever, H):
    """Distance between two antennas and its Jacobian; ``lever`` is offset_j - offset_i [m]."""
    r0, r1, r2 = x[0] + lever[0], x[1] + lever[1], x[2] + lever[2]
    distance = np.sqrt(r0 * r0 + r1 * r1 + r2 * r2)
    inverse = 1.0 / max(distance, MIN_DISTANCE)
    H[0], H[1], H[2] = r0 * inverse, r1 * inverse, r2 * inverse
    H[3] = H[4] = H[5] = 0.0
    return distance


@kernel
def range_rate_model(x, lever, H):
    """Rate of the distance, ``u . vel`` with u the unit vector along it, and its Jacobian."""
    distance = max(range_model(x, lever, H), MIN_DISTANCE)
    rate = H[0] * x[3] + H[1] * x[4] + H[2] * x[5]
    for k in range(3):
        u = H[k]
        H[k] = (x[3 + k] - rate * u) / distance
        H[3 + k] = u
    return rate


@kernel
def speed_model(x, H):
    """Relative speed ``|vel|`` and its Jacobian: the model that the paper's text writes."""
    speed = np.sqrt(x[3] * x[3] + x[4] * x[4] + x[5] * x[5])
    inverse = 1.0 / max(speed, 1e-6)
    for k in range(3):
        H[k] = 0.0
        H[3 + k] = x[3 + k] * inverse
    return speed
