"""EKF of one pair in plain numpy, eq. (5) to (11) of the paper: see `paper_reference`."""

from __future__ import annotations

import numpy as np

from tracking.arrays import F64
from tracking.filters.paper.params import PaperParams
from tracking.geometry import quat_conjugate, quat_left, quat_multiply, quat_right

CONJUGATE = np.diag([1.0, -1.0, -1.0, -1.0])
TINY = 1e-6
"""[m, m/s] Least length of vectors with a direction."""


class PairFilter:
    """EKF of one pair, started by its first k measurements."""

    def __init__(self, d: int, x_0: F64, q_0: F64, t: float, distance: float, static: bool) -> None:
        self.x = np.concatenate([x_0, np.zeros(3), q_0])  # v_0 = 0
        axes = np.arange(3) < d
        self.P = np.diag(np.concatenate([axes, axes & (not static), np.ones(4)]).astype(float))
        self.t = self.t_range = t
        self.mean = self.last = distance
        self.rate, self.n_rejected = 0.0, 0

    def predict(self, t: float, u: F64, Sigma_u: F64, d: int) -> None:
        """Dead reckoning to time t with ``u = (a_i, a_j, q_i, q_j)``, eq. (7) to (9)."""
        dT = t - self.t
        a_i, a_j, q_i, q_j = u[:3], u[3:6], u[6:10], u[10:]
        self.x[6:] = quat_multiply(quat_conjugate(q_i), q_j)
        if dT <= 0.0:
            return
        one = np.diag((np.arange(3) < d).astype(float))
        F = np.zeros((10, 10))  # q_ij is a function of the control only
        F[:3, :3], F[:3, 3:6], F[3:6, 3:6] = one, dT * one, one
        W = np.zeros((10, 14))
        W[:3, :3], W[:3, 3:6] = -0.5 * dT**2 * one, 0.5 * dT**2 * one
        W[3:6, :3], W[3:6, 3:6] = -dT * one, dT * one
        W[6:, 6:10] = quat_right(q_j) @ CONJUGATE
        W[6:, 10:] = quat_left(quat_conjugate(q_i))
        self.x[:6] = F[:6, :6] @ self.x[:6] + W[:6, :6] @ np.concatenate([a_i, a_j])
        self.P = F @ self.P @ F.T + W @ Sigma_u @ W.T
        self.t = t

    def correct(self, t: float, distance: float, c: PaperParams) -> float | None:
        """Gate a range, then correct with it and its derivative, eq. (10) and (11).

        Returns:
            The range's squared innovation over its variance; None for an outlier.
        """
        age = t - self.t_range
        x, v = self.x[:3], self.x[3:6]
        if abs(distance - self.mean) > c.gate_floor + c.gate_gain * float(np.linalg.norm(v)):
            self.n_rejected += 1
            if self.n_rejected < c.gate_reset:
                return None
            self.mean, self.rate = distance, 0.0
        else:
            self.mean += age / (c.gate_tau + age) * (distance - self.mean)
            if age > 0.0:
                raw = (distance - self.last) / age
                self.rate += age / (c.speed_tau + age) * (raw - self.rate)
        self.n_rejected, self.last, self.t_range = 0, distance, t
        d, speed = float(np.linalg.norm(x)), float(np.linalg.norm(v))
        u = x / d if d > TINY else np.zeros(3)
        H = np.zeros((2, 10))
        H[0, :3] = u
        if c.speed == "norm":
            H[1, 3:6] = v / speed if speed > TINY else 0.0
            h, z = np.array([d, speed]), np.array([distance, abs(self.rate)])
        else:
            H[1, :3], H[1, 3:6] = (v - u * (u @ v)) / d if d > TINY else 0.0, u
            h, z = np.array([d, u @ v]), np.array([distance, self.rate])
        R = np.diag([c.range_std**2, c.speed_std**2])
        S = H @ self.P @ H.T + R
        K = self.P @ H.T @ np.linalg.inv(S)
        self.x += K @ (z - h)
        self.P = self.P - K @ S @ K.T
        return float((z[0] - h[0]) ** 2 / S[0, 0])

    def use_mds(self, x: F64, c: PaperParams, d: int) -> None:
        """Adopt the refined relative position of the pair."""
        if c.feedback == "replace":
            self.x[:3] = x
        elif c.feedback == "update":
            H = np.eye(10)[:d]
            K = self.P @ H.T @ np.linalg.inv(H @ self.P @ H.T + c.mds_std**2 * np.eye(d))
            self.x += K @ (x[:d] - self.x[:d])
            self.P = self.P - K @ H @ self.P
