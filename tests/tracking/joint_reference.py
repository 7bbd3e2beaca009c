"""Reference implementation of the joint filter's core in plain numpy: its specification.

One hypothesis of a running group of moving nodes in the plane, without lever arms: prediction, and
correction by ranges with NLOS, the non-holonomic constraint, zero velocity, the mean velocity and
the gauge. It has no hypotheses, supervision, start or learning of noise. Derivatives are complex
steps [1], covariances are full products, updates have the Joseph form.
`tests/tracking/test_joint_reference.py` runs both on the same events.

References:
    [1] Squire, Trapp, Using complex variables to estimate derivatives of real functions, SIAM
        Review 40 (1998) 110.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from tracking.arrays import F64
from tracking.geometry import GRAVITY, quat_to_matrix

STEP, NEGLIGIBLE, LINE = 1e-30, 1e-3, 1e-3


def decay(ratio: Any) -> Any:
    """Return the filter's ``exp(-ratio)``, to second order."""
    return 1.0 / (1.0 + ratio * (1.0 + 0.5 * ratio))


def normal(off: float, variance: float) -> float:
    """Return the Gaussian likelihood without the factor 1 / root(2 pi)."""
    return float(np.exp(-0.5 * off * off / variance) / np.sqrt(variance))


def jacobian(function: Callable[[Any], Any], x: F64) -> F64:
    """Return derivatives of a function by complex steps, (value, state)."""
    steps = x + 1j * STEP * np.eye(len(x))
    return np.array([np.imag(function(step)) / STEP for step in steps]).T


class JointReference:
    """The core of the filter, started from the arrays of one running environment of `JointEkf`."""

    def __init__(self, coefficients: Any, state: Any, pair_index: Any) -> None:
        self.c, self.pair_index = coefficients, pair_index
        self.nodes, self.pairs = state.nodes.copy(), state.pairs.copy()
        self.group, h = state.group[0].copy(), int(state.group[0]["best"])
        self.x, self.nlos = state.x[h].copy(), state.nlos[h].copy()
        W = state.pending_updates[h, : state.n_pending[h]]
        self.P, self.stays = state.P[h] - W.T @ W, state.bias_retention[h].copy()
        self.moved = state.accumulated_correction[h].copy()
        self.held, self.sums = state.last_attitude_accel.copy(), state.preintegrated.copy()
        self.i_pos = self.nodes["i_pos"][:, None] + [0, 1]  # (node, 2)
        names = ("i_pos", "i_vel", "i_tilt_bias", "i_heading")
        self.indices = [[int(node[name]) for name in names] for node in self.nodes]

    def attitude(self, i: int, t: float, q: F64, accel: F64) -> None:
        """Process an orientation and an acceleration in the world."""
        node, c, held = self.nodes[i], self.c, self.held[i]
        self.integrate(i, t)
        R, dt = quat_to_matrix(q), t - node["t_state"]
        direction = R[:2, 0] / np.hypot(*R[:2, 0])
        turn = np.angle((node["cos_yaw"] - 1j * node["sin_yaw"]) * (direction @ [1.0, 1j]))
        angle = 2.0 * np.sqrt(max(2.0 * (1.0 - min(abs(q @ held[:4]), 1.0)), 0.0))
        keep = decay(dt / self.c["yaw_rate_tau"])
        node["yaw_rate"] = keep * node["yaw_rate"] + (1.0 - keep) * turn / dt
        keep = decay(dt / self.c["rest_tau"])
        node["turning"] = keep * node["turning"] + (1.0 - keep) * angle / dt
        if node["levelled"]:
            accel, force = 1.0 * accel, R.T @ (accel + [0.0, 0.0, GRAVITY])
            yaw = np.array([[direction[0], -direction[1]], [direction[1], direction[0]]])
            accel[:2] = yaw @ force[:2]
        self.sums[i, 1:4] += 0.5 * dt * (accel - held[4:])
        self.sums[i, 4:7] += 0.25 * dt * dt * (accel - held[4:])
        if np.hypot(*accel[:2]) > node["impact_threshold"]:
            self.sums[i, 11] += (node["impact_noise_ratio"] * dt) ** 2 * (accel[:2] @ accel[:2])
        held[:4], held[4:], node["t_state"] = q, accel, t
        node["cos_yaw"], node["sin_yaw"] = direction
        off = np.linalg.norm(accel) - node["accel_mean"]
        node["accel_mean"] += (1.0 - keep) * off
        node["accel_var"] = keep * node["accel_var"] + (1.0 - keep) * off * off
        shaken = node["accel_var"] + 0.25 * node["accel_mean"] ** 2 >= c["rest_accel"] ** 2
        if shaken or node["turning"] >= c["rest_rate"]:
            node["t_moved"] = t

    def integrate(self, i: int, t: float) -> None:
        """Integrate the last acceleration and the body's x axis until t."""
        node, s = self.nodes[i], self.sums[i]
        dt, node["t_pre"] = t - node["t_pre"], t
        axes = [node["cos_yaw"], node["sin_yaw"]] if node["levelled"] else [1.0, 0.0]
        for once, twice, a in ((s[1:4], s[4:7], self.held[i, 4:]), (s[7:9], s[9:11], axes)):
            twice += dt * once + 0.5 * dt * dt * np.array(a)
            once += dt * np.array(a)
        s[0] += dt

    def increments(self, x: Any, i: int) -> list[Any]:
        """Return increments of position and velocity beyond ``T v``: ``R dp - R_b B b``, (2) each.

        B rotates a bias with the body, and R_b is R, for level vehicles; both are 1 otherwise.
        """
        s, node, out = self.sums[i], self.nodes[i], []
        cos, sin = np.cos(x[node["i_heading"]]), np.sin(x[node["i_heading"]])
        R, b = np.array([[cos, -sin], [sin, cos]]), int(node["i_tilt_bias"])
        for a, (c_b, s_b) in ((s[4:6], s[9:11]), (s[1:3], s[7:9])):
            B = np.array([[c_b, -s_b], [s_b, c_b]])
            out.append(R @ a - (R @ B if node["levelled"] else B) @ x[b : b + 2])
        return out

    def move(self, x: Any) -> Any:
        """Dead-reckon all nodes, without the decay of states."""
        new = x.copy()
        for i, (p, v, _, _) in enumerate(self.indices):
            dp, dv = self.increments(x, i)
            new[p : p + 2] += self.sums[i, 0] * x[v : v + 2] + dp
            new[v : v + 2] += dv
        return new

    def predict(self, t: float) -> None:
        """Predict states and covariance at t."""
        c, x, step = self.c, self.x, t - self.group["t"]
        scale, speed = np.ones(len(x)), np.zeros(len(self.nodes))
        for i in range(len(self.nodes)):
            self.integrate(i, t)
        self.follow()
        F, Q = jacobian(self.move, x), np.zeros_like(self.P)
        self.x = x = self.move(x)
        for i, (p, v, b, y) in enumerate(self.indices):
            node, T = self.nodes[i], self.sums[i, 0]
            self.moved[p : p + 2] += T * self.moved[v : v + 2]
            speed[i] = np.linalg.norm(x[v : v + 2])
            scale[b : b + 2], scale[y] = decay(T / node["bias_tau"]), decay(T / node["heading_tau"])
            q = node["psd2"] * T + self.sums[i, 11]
            for k in range(2):
                at = [p + k, v + k]
                Q[np.ix_(at, at)] += q * np.array([[T * T / 3.0, 0.5 * T], [0.5 * T, 1.0]])
                Q[b + k, b + k] = (1.0 - scale[b] ** 2) * node["bias_var"]
            Q[y, y] = (1.0 - scale[y] ** 2) * node["heading_var"]
        mean = np.zeros(len(x))
        for p, pair in enumerate(self.pairs):
            fast, slow, hidden = pair["i_range_error"], pair["i_range_error"] + 1, self.nlos[p]
            way = (speed[pair["i"]] + speed[pair["j"]]) * step
            length = (1.0 - hidden) / c["slow_length"] + hidden / c["nlos_bias_length"]
            scale[fast] = decay(way / c["fast_length"])
            scale[slow] = decay(way * length) * self.stays[p]
            mean[slow] = (1.0 - scale[slow]) * hidden * c["nlos_bias"]
            Q[fast, fast] = (1.0 - scale[fast] ** 2) * c["fast_var"]
            Q[slow, slow] = (1.0 - scale[slow] ** 2) * (c["slow_var"] + hidden * c["nlos_bias_var"])
        self.x, F = scale * x + mean, scale[:, None] * F
        self.P = F @ self.P @ F.T + Q
        self.stays[:], self.sums[:], self.group["t"] = 1.0, 0.0, t

    def follow(self) -> None:
        """Keep the rotation of the group unobservable: ``P <- T P T^T`` as estimates move."""
        c, n, at = self.c, len(self.x), self.i_pos
        pos, shift = self.x[at], self.moved[at]
        out2 = ((pos - pos.mean(axis=0)) ** 2).sum()
        moved2 = ((shift - shift.mean(axis=0)) ** 2).sum()
        false2 = moved2 * self.group["heading_gauge_var"] / c["white_var"]
        if moved2 <= c["follow_share"] ** 2 * out2 and false2 <= c["follow_false"] ** 2:
            return
        share, G = min(1.0, c["follow_most"] * np.sqrt(out2 / moved2)), np.zeros(n)
        A = self.read_rotation(pos - shift) / (1.0 + LINE)
        move = share * (shift - shift.mean(axis=0))
        G[at] = np.stack([-move[:, 1], move[:, 0]], axis=1)
        for _, v, _, _ in self.indices:
            G[v], G[v + 1] = -share * self.moved[v + 1], share * self.moved[v]
        T = np.eye(n) + np.outer(G, A)
        self.P, self.moved[:] = T @ self.P @ T.T, 0.0

    def read_rotation(self, pos: F64) -> F64:
        """Return the functional from state errors to the group's rotation, by least squares."""
        A, out = np.zeros(len(self.x)), pos - pos.mean(axis=0)
        A[self.i_pos] = np.stack([-out[:, 1], out[:, 0]], axis=1)
        return A / (A @ A + 1e-9)

    def update(self, H: F64, nu: float, R: float) -> None:  # noqa: N803
        """Apply a Kalman update in Joseph form."""
        K = self.P @ H / (H @ self.P @ H + R)
        A = np.eye(len(self.x)) - np.outer(K, H)
        self.x, self.P = self.x + K * nu, A @ self.P @ A.T + R * np.outer(K, K)
        self.moved += K * nu

    def distance(self, p: int) -> Callable[[Any], Any]:
        """Return the predicted range of a pair, errors included, as a function of the states."""
        i, j, e = (int(self.pairs[p][name]) for name in ("i", "j", "i_range_error"))

        def where(x: Any, i: int) -> Any:
            p, v, *_ = self.indices[i]
            # The influence of biases and headings on the way since the states' time is neglected.
            way, _ = self.increments(np.real(x), i)
            return x[p : p + 2] + self.sums[i, 0] * x[v : v + 2] + way

        def predicted(x: Any) -> Any:
            out = where(x, j) - where(x, i)
            return np.sqrt((out * out).sum()) + x[e] + x[e + 1]

        return predicted

    def range(self, p: int, t: float, z: float, evidence: float, rates: Any, share: float) -> None:
        """Correct with a range between two origins; the last three depend on its powers."""
        c, pair, slow = self.c, self.pairs[p], int(self.pairs[p]["i_range_error"]) + 1
        if self.group["heading_gauge_var"] > c["gauge_std"] ** 2:
            self.follow()
        model = self.distance(p)
        H, nu = jacobian(model, self.x), z - model(self.x)
        bent = self.second_order(p, H)
        # Four LOS/NLOS transitions; they reset the bias.
        S = H @ self.P @ H + bent + c["white_var"]
        less = max(self.P[slow, slow] - 2.0 * self.P[slow] @ H, 0.9 * (c["white_var"] - S))
        leave_var = S + less + c["slow_var"]
        a, b = np.array(rates) / sum(rates) * -np.expm1(-sum(rates) * (t - pair["t_range"]))
        prior = np.array([[1.0 - self.nlos[p]], [self.nlos[p]]]) * [[1.0 - a, a], [b, 1.0 - b]]
        mean = np.array([c["nlos_bias"], c["nlos_bias_large"]])
        var = np.array([c["nlos_bias_var"], c["nlos_bias_large_var"]])
        enters = [1.0 - share, share] * np.array([normal(nu - mean[k], S + var[k]) for k in (0, 1)])
        like = [
            [normal(nu, S), enters.sum()],
            [normal(nu + self.x[slow], leave_var), normal(nu, S)],
        ]
        chance = prior * like * [1.0, np.exp(evidence)]
        total = chance.sum()
        switched = (chance[0, 1] + chance[1, 0]) / total
        self.nlos[p] = hidden = np.clip(chance[:, 1].sum() / total, 1e-4, 1.0 - 1e-4)
        sane = total / (total + np.sqrt(2.0 * np.pi) * c["outlier_prob"] / c["outlier_span"])
        nis = min(nu * nu / S, c["largest_nis"])
        if switched < c["reset_at_once"]:
            self.stays[p] *= 1.0 - switched
        else:
            keep, old_var = np.ones(len(self.x)), self.P[slow, slow]
            keep[slow] = stays = 1.0 - switched
            weight = enters / enters.sum()
            bias, squared = weight @ mean, weight @ (var + mean**2)
            off = self.x[slow] - hidden * bias
            new_var = c["slow_var"] + hidden * (squared - hidden * bias**2)
            self.P *= np.outer(keep, keep)
            self.P[slow, slow] += switched * (stays * old_var + new_var + stays * off * off)
            self.x[slow] -= switched * off
            nu = z - model(self.x)
        R = c["white_var"] + bent + hidden * c["nlos_white_var"]
        doubt = pair["mean_nis"] / (c["contradiction_share"] * c["pair_nis_limit"])
        trust = sane / max(doubt, 1.0) ** 4
        if trust > 1e-3:
            self.update(H, nu, R / trust)
        nis = nis if sane > 0.5 else c["largest_nis"]
        pair["mean_nis"] += c["nis_gain"] * (nis - pair["mean_nis"])
        pair["t_range"] = t

    def second_order(self, p: int, H: F64) -> float:  # noqa: N803
        """Return the second-order variance of a range, ``(gain tr(P_across) / (2 r))^2``."""
        c, pair, D = self.c, self.pairs[p], np.zeros((2, len(self.x)))
        i, j = self.i_pos[pair["i"]], self.i_pos[pair["j"]]
        D[[0, 1], i], D[[0, 1], j] = -1.0, 1.0
        cov, out, u = D @ self.P @ D.T, D @ self.x, H[j]
        gain = 0.5 * c["nonlinearity_gain"] / np.sqrt(out @ out + 0.01)
        if (gain * np.trace(cov)) ** 2 < NEGLIGIBLE * c["white_var"]:
            return 0.0
        return float(min(gain * max(np.trace(cov) - u @ cov @ u, 0.0), c["largest_bend"]) ** 2)

    def constrain(self, t: float) -> None:
        """Apply zero velocity at rest, non-holonomic constraints, and the mean velocity."""
        c, n = self.c, len(self.x)
        dt, self.group["t_constraints"] = t - self.group["t_constraints"], t
        before = self.x.copy()  # one linearisation point: the order of axles is irrelevant
        for node, (_, v, _, y) in zip(self.nodes, self.indices, strict=True):
            if node["rests"] and t - node["t_moved"] > c["rest_after"]:
                floor = c["glide_nis"] * (c["rest_var"] + np.diagonal(self.P)[v : v + 2])
                if (self.x[v : v + 2] ** 2 > floor).any():
                    node["t_moved"] = t
                    continue
                for k in range(2):
                    self.update(np.eye(n)[v + k], -self.x[v + k], c["rest_var"])
            elif node["sideways_var"] > 0.0:
                model = partial(self.slides, node, v, y)
                H = jacobian(model, before)
                nu = -model(before) - H @ (self.x - before)
                self.update(H, nu, node["sideways_var"])
        for k in range(2):
            H = np.isin(np.arange(n), self.nodes["i_vel"] + k) / len(self.nodes)
            self.update(H, -(H @ self.x), self.nodes["speed_var"].mean() / max(dt, 1e-3))

    @staticmethod
    def slides(node: Any, v: int, y: int, x: Any) -> Any:
        """Return the sideways velocity of an axle without the slip of its tyres."""
        yaw, w = np.arctan2(node["sin_yaw"], node["cos_yaw"]) + x[y], node["yaw_rate"]
        m, cos, sin = node["i_mount"], np.cos(yaw), np.sin(yaw)
        ahead, slip = (x[m], x[m + 1]) if m >= 0 else (node["ahead"], node["slip"])
        forward = cos * x[v] + sin * x[v + 1] + node["aside"] * w
        return cos * x[v + 1] - sin * x[v] - ahead * w + slip * w * forward**2

    def centre(self, t: float) -> None:
        """Move the centre of the group to the origin, with a fixed uncertainty."""
        for k in range(2):
            all_k, T = np.ix_(self.i_pos[:, k], self.i_pos[:, k]), np.eye(len(self.x))
            T[all_k] -= 1.0 / len(self.nodes)
            self.x, self.P = T @ self.x, T @ self.P @ T.T
            self.P[all_k] += self.c["centre_std"] ** 2
        self.group["t_gauge"] = t
