"""Bank of Kalman filters for positions, model of constant velocity.

The velocity is driven by white noise of density q = accel_psd**2 along every axis [1],

    p' = v,  v' = w,  E[w(t) w(s)] = q delta(t - s),

so over a time dt

    F = [1 dt; 0 1],  Q = q [dt**3/3 dt**2/2; dt**2/2 dt].

Unlike differences through a fixed low-pass, the filter weighs each position by its covariance,
accepts irregular intervals, and estimates the velocity covariance that the safety gate needs.

References:
    [1] Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation,
        Wiley 2001, section 6.2.2.
"""

from __future__ import annotations

import numpy as np

from hardware_bridge.external_tracker.pending import PositionReport
from tracking.arrays import F64, I64
from tracking.estimate import Status

EYE = np.eye(3)


class Tracks:
    """The filters, arrays over (track, ...).

    Invariants: a position with a velocity replaces the state, since it is the output of a filter;
    positions alone are measurements. Reports older than the last of their track are ignored.
    """

    def __init__(self, n: int, psd: F64, first_vel_std: F64, std: float, vel_std: float) -> None:
        """Create tracks without reports.

        Args:
            n: Number of tracks.
            psd: Acceleration noise density of each, (track) [m/s2/sqrt(Hz)].
            first_vel_std: Standard deviation of the velocity before the second position, (track)
                [m/s].
            std: Standard deviation of positions without a covariance [m].
            vel_std: Standard deviation of velocities without a covariance [m/s].
        """
        self._q, self._first_var = psd**2, first_vel_std**2
        self._var, self._vel_var = std * std * EYE, vel_std * vel_std * EYE
        self.x: F64 = np.zeros((n, 6))
        """State at `t`, position [m] and velocity [m/s], (track, 6)."""
        self.P: F64 = np.zeros((n, 6, 6))
        """Covariance of the state, (track, 6, 6)."""
        self.t: F64 = np.full(n, -np.inf)
        """Time of the last report of each [s]; -inf before the first."""
        self.status: I64 = np.full(n, Status.ABSENT, dtype=np.int64)
        """Status of the last report."""
        self.nlos: F64 = np.zeros(n)
        """NLOS probability of the last report [-]."""

    def forget(self, tracks: int | I64) -> None:
        """Discard the reports of these tracks."""
        self.t[tracks] = -np.inf
        self.status[tracks] = Status.ABSENT
        self.nlos[tracks] = 0.0

    def take(self, reports: list[tuple[int, PositionReport]]) -> None:
        """Process reports, with the indices of their tracks, in the order of arrival."""
        waiting = reports
        while waiting:
            # Each round takes one report per track and processes all tracks at once.
            now: dict[int, PositionReport] = {}
            later = []
            for k, place in waiting:
                if k in now:
                    later.append((k, place))
                else:
                    now[k] = place
            self._take_round({k: p for k, p in now.items() if p.t >= self.t[k]})
            waiting = later

    def at(self, now: float) -> tuple[F64, F64]:
        """Predict states (track, 6) and covariances (track, 6, 6); undefined before a report."""
        dt = np.where(np.isfinite(self.t), now - self.t, 0.0)
        return self._carried(np.arange(len(self.t)), np.maximum(dt, 0.0))

    def _take_round(self, reports: dict[int, PositionReport]) -> None:
        if not reports:
            return
        k = np.fromiter(reports, dtype=np.int64)
        t = np.array([p.t for p in reports.values()])
        z = np.array([p.pos for p in reports.values()])
        R = np.array(  # noqa: N806
            [self._var if p.cov is None else p.cov[:3, :3] for p in reports.values()]
        )
        new = ~np.isfinite(self.t[k])
        whole = np.array([p.vel is not None for p in reports.values()])
        self._begin(k[new & ~whole], z[new & ~whole], R[new & ~whole])
        follows = ~new & ~whole
        self._update(k[follows], t[follows] - self.t[k[follows]], z[follows], R[follows])
        for track, place in reports.items():
            if place.vel is not None:
                self.x[track] = (*place.pos, *place.vel)
                self.P[track] = self._whole_cov(place)
            self.status[track], self.nlos[track] = place.status, place.nlos
        self.t[k] = t

    def _whole_cov(self, place: PositionReport) -> F64:
        if place.cov is not None and len(place.cov) == 6:
            return place.cov
        P = np.zeros((6, 6))  # noqa: N806
        P[:3, :3] = self._var if place.cov is None else place.cov
        P[3:, 3:] = self._vel_var
        return P

    def _begin(self, k: I64, z: F64, R: F64) -> None:  # noqa: N803
        self.x[k, :3], self.x[k, 3:] = z, 0.0
        self.P[k] = 0.0
        self.P[k, :3, :3] = R
        self.P[k, 3:, 3:] = self._first_var[k, None, None] * EYE

    def _update(self, k: I64, dt: F64, z: F64, R: F64) -> None:  # noqa: N803
        x, P = self._carried(k, dt)  # noqa: N806
        K = P[:, :, :3] @ np.linalg.inv(P[:, :3, :3] + R)  # noqa: N806
        self.x[k] = x + (K @ (z - x[:, :3])[..., None])[..., 0]
        left = np.broadcast_to(np.eye(6), P.shape).copy()
        left[:, :, :3] -= K
        # Joseph form, keeps P positive definite.
        self.P[k] = left @ P @ left.swapaxes(1, 2) + K @ R @ K.swapaxes(1, 2)

    def _carried(self, k: I64, dt: F64) -> tuple[F64, F64]:
        x = self.x[k].copy()
        x[:, :3] += dt[:, None] * x[:, 3:]
        F = np.broadcast_to(np.eye(6), (len(k), 6, 6)).copy()  # noqa: N806
        F[:, :3, 3:] = dt[:, None, None] * EYE
        P = F @ self.P[k] @ F.swapaxes(1, 2)  # noqa: N806
        q = self._q[k]
        P[:, :3, :3] += (q * dt**3 / 3.0)[:, None, None] * EYE
        P[:, :3, 3:] += (q * dt**2 / 2.0)[:, None, None] * EYE
        P[:, 3:, :3] += (q * dt**2 / 2.0)[:, None, None] * EYE
        P[:, 3:, 3:] += (q * dt)[:, None, None] * EYE
        return x, 0.5 * (P + P.swapaxes(1, 2))
