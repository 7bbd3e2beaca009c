"""The Kalman filter of one pair: prediction and scalar corrections, in place.

State ``x = (pos_ij, vel_ij, e)`` and covariance ``P`` of pair p in hypothesis h; e is the slow
error of the pair's ranges, and optional. In two dimensions the vertical rows stay exactly zero.
Arrays are indexed inside the kernels, since passing slices costs more than the algebra.
"""

from __future__ import annotations

from tracking.kernels.jit import small_kernel
from tracking.models.range import range_model


@small_kernel
def predict(x, P, p, h, dt, a0, a1, a2, psd, d):
    """Predict a pair over dt [s] with a constant relative acceleration a0 a1 a2 [m/s2].

    ``pos += dt vel + dt^2/2 a``, ``vel += dt a`` and
    ``P = F P F^T + W (psd^2 / dt) W^T`` with ``W = (dt^2/2, dt)`` per axis, [1] eq. 8-9.
    """
    if dt <= 0.0:
        return
    half = 0.5 * dt * dt
    x[p, h, 0] += dt * x[p, h, 3] + half * a0
    x[p, h, 3] += dt * a0
    x[p, h, 1] += dt * x[p, h, 4] + half * a1
    x[p, h, 4] += dt * a1
    if d == 3:
        x[p, h, 2] += dt * x[p, h, 5] + half * a2
        x[p, h, 5] += dt * a2
    for r in range(d):
        for k in range(r, d):
            p_vv = P[p, h, 3 + r, 3 + k]
            p_xx = P[p, h, r, k] + dt * (P[p, h, r, 3 + k] + P[p, h, k, 3 + r]) + dt * dt * p_vv
            P[p, h, r, k] = p_xx
            P[p, h, k, r] = p_xx
    for r in range(d):
        for k in range(d):
            p_xv = P[p, h, r, 3 + k] + dt * P[p, h, 3 + r, 3 + k]
            P[p, h, r, 3 + k] = p_xv
            P[p, h, 3 + k, r] = p_xv
    for e in range(6, x.shape[2]):
        for k in range(d):
            p_xe = P[p, h, k, e] + dt * P[p, h, 3 + k, e]
            P[p, h, k, e] = p_xe
            P[p, h, e, k] = p_xe
    q = psd * psd * dt
    for k in range(d):
        P[p, h, k, k] += 0.25 * q * dt * dt
        p_xv = P[p, h, k, 3 + k] + 0.5 * q * dt
        P[p, h, k, 3 + k] = p_xv
        P[p, h, 3 + k, k] = p_xv
        P[p, h, 3 + k, 3 + k] += q


@small_kernel
def correct(x, P, p, h, work, nu, R):
    """Apply a scalar Kalman update with innovation nu; return its variance S.

    With the optimal gain ``K = PH / S`` the Joseph form reduces to ``P - K (PH)^T``. One
    triangle is computed and copied to the other, so that P stays exactly symmetric.

    Args:
        x: States.
        P: Covariances.
        p: Pair.
        h: Hypothesis.
        work: Row 0 holds the Jacobian H; row 1 is scratch; (2, state).
        nu: Innovation.
        R: Variance of the measurement.
    """
    m = x.shape[2]
    S = R
    for r in range(m):
        s = 0.0
        for k in range(m):
            s += P[p, h, r, k] * work[0, k]
        work[1, r] = s
        S += work[0, r] * s
    inv_S = 1.0 / S
    for r in range(m):
        x[p, h, r] += work[1, r] * inv_S * nu
    for r in range(m):
        K_r = work[1, r] * inv_S
        for k in range(r, m):
            v = P[p, h, r, k] - K_r * work[1, k]
            P[p, h, r, k] = v
            P[p, h, k, r] = v
    return S


@small_kernel
def predict_range(x, p, h, l0, l1, l2, work):
    """Return the range between two antennas with its slow error; write H to row 0 of work.

    ``l0 l1 l2`` is the antenna offset of j minus that of i, world frame [m].
    """
    distance, u0, u1, u2 = range_model(x[p, h, 0] + l0, x[p, h, 1] + l1, x[p, h, 2] + l2)
    work[0, 0], work[0, 1], work[0, 2] = u0, u1, u2
    work[0, 3] = work[0, 4] = work[0, 5] = 0.0
    for e in range(6, x.shape[2]):
        work[0, e] = 1.0
        distance += x[p, h, e]
    return distance
