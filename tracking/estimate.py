"""Estimates of the tracker: relative positions of all pairs and their covariances."""

from __future__ import annotations

from dataclasses import dataclass, fields
from enum import IntEnum
from typing import Any

import numpy as np

from tracking.arrays import F64, I64, Bool
from tracking.constellation import Constellation
from tracking.errors import ConfigError
from tracking.geometry import quat_conjugate, quat_multiply, quat_to_matrix
from tracking.params.short_repr import short_repr


class Status(IntEnum):
    """Usability of a pair's estimate."""

    ABSENT = 0
    """One of the two nodes is not in the group."""
    STARTING = 1
    """Not enough measurements yet; position and covariance are meaningless."""
    AMBIGUOUS = 2
    """The shape is known, but not its rotation or its reflection."""
    OK = 3
    """Position, velocity and covariance are valid, within the required accuracy."""
    LOST = 4
    """Without ranges for so long that the position is dead reckoned, or less certain than the
    required accuracy (`VehicleParams.accuracy`)."""
    DOUBTFUL = 5
    """Its ranges contradict the rest: a faulty node, a wrong calibration or a diverged filter."""


@dataclass(frozen=True, slots=True)
class TeamEstimate:
    """Estimates of all pairs, arrays over (..., pair).

    The leading axes are (env,) for one instant and (env, time) for a run. Pairs are those of
    `Constellation.pairs`; `between` gives either order.
    """

    __repr__ = short_repr

    constellation: Constellation
    t: F64
    """Time of the estimate, (...) [s]."""
    pos_ij_w: F64
    """p_j - p_i, (..., pair, 3) [m]."""
    vel_ij_w: F64
    """v_j - v_i, (..., pair, 3) [m/s]."""
    cov: F64
    """Covariance of position and velocity, (..., pair, 6, 6); zero along z in a plane."""
    q_wb: F64
    """Orientation of each node, (..., node, 4)."""
    has_orientation: Bool
    """True if `q_wb` came from measurements, (..., node)."""
    age: F64
    """Time since the last range, (..., pair) [s]; 0 before the first."""
    nis: F64
    """Normalised innovation squared of the last range, (..., pair) [-]."""
    nlos_prob: F64
    """Probability that the last range was NLOS, (..., pair) [-]; 0 from filters without it."""
    status: I64
    """A `Status`, (..., pair)."""

    @classmethod
    def empty(cls, constellation: Constellation, t: F64) -> TeamEstimate:
        """Return zeros for the given times, (...), to be filled."""
        n, p, lead = constellation.n_nodes, constellation.n_pairs, t.shape
        return cls(
            constellation=constellation,
            t=t,
            pos_ij_w=np.zeros((*lead, p, 3)),
            vel_ij_w=np.zeros((*lead, p, 3)),
            cov=np.zeros((*lead, p, 6, 6)),
            q_wb=np.zeros((*lead, n, 4)),
            has_orientation=np.zeros((*lead, n), dtype=bool),
            age=np.zeros((*lead, p)),
            nis=np.zeros((*lead, p)),
            nlos_prob=np.zeros((*lead, p)),
            status=np.zeros((*lead, p), dtype=np.int64),
        )

    @property
    def arrays(self) -> tuple[Any, ...]:
        """Fields except the time, in order, as kernel arguments."""
        return (
            self.pos_ij_w,
            self.vel_ij_w,
            self.cov,
            self.q_wb,
            self.has_orientation,
            self.age,
            self.nis,
            self.nlos_prob,
            self.status,
        )

    def with_time_axis(self) -> TeamEstimate:
        """Return arrays over (env, 1, ...) that share the memory of these over (env, ...)."""
        return TeamEstimate(
            self.constellation, self.t[:, None], *(array[:, None] for array in self.arrays)
        )

    @property
    def ok(self) -> Bool:
        """True if the estimate can be used, (..., pair)."""
        return np.asarray(self.status == Status.OK)

    @property
    def pos_std(self) -> F64:
        """Standard deviation of each position axis, (..., pair, 3) [m]."""
        return np.sqrt(np.diagonal(self.cov, axis1=-2, axis2=-1)[..., :3])

    def between(self, i: int, j: int) -> tuple[F64, F64]:
        """Return position and velocity of node j relative to i in the world frame, each (..., 3).

        Args:
            i: Index of a node in `constellation.nodes`, `constellation.index_of[id]`.
            j: Index of another node.

        Raises:
            ConfigError: i and j are equal, or there is no such node.
        """
        self._check_nodes("between", i, j)
        if i == j:
            raise ConfigError(f"between: expected two different nodes, got {i} twice")
        pair = self.constellation.pair_index[i, j]
        sign = 1.0 if i < j else -1.0
        return sign * self.pos_ij_w[..., pair, :], sign * self.vel_ij_w[..., pair, :]

    def between_b(self, i: int, j: int) -> tuple[F64, F64]:
        """Return position and velocity of node j relative to i in i's body frame, each (..., 3)."""
        pos_w, vel_w = self.between(i, j)
        R_bw = np.swapaxes(quat_to_matrix(self.q_wb[..., i, :]), -1, -2)  # noqa: N806
        return (R_bw @ pos_w[..., None])[..., 0], (R_bw @ vel_w[..., None])[..., 0]

    def relative_orientation(self, i: int, j: int) -> F64:
        """Return q_ij = q_i^-1 q_j, the orientation of body j in body frame i, (..., 4)."""
        self._check_nodes("relative_orientation", i, j)
        return quat_multiply(quat_conjugate(self.q_wb[..., i, :]), self.q_wb[..., j, :])

    def _check_nodes(self, method: str, *indices: int) -> None:
        n = self.constellation.n_nodes
        for k in indices:
            if not isinstance(k, int | np.integer) or isinstance(k, bool) or not 0 <= k < n:
                raise ConfigError(f"{method}: expected node indices 0 to {n - 1}, got {k!r}")

    def at(self, t: F64 | float) -> TeamEstimate:
        """Predict the estimate at another time with constant velocity.

        The covariance is propagated without process noise: meant for the tenth of a second between
        the tracker's delayed horizon and the current time.
        """
        t = np.broadcast_to(np.asarray(t, dtype=np.float64), self.t.shape)
        dt = (t - self.t)[..., None, None]
        F = np.broadcast_to(np.eye(6), self.cov.shape).copy()  # noqa: N806
        F[..., :3, 3:] = dt[..., None] * np.eye(3)
        changed = {
            "t": t.copy(),
            "pos_ij_w": self.pos_ij_w + dt * self.vel_ij_w,
            "cov": F @ self.cov @ np.swapaxes(F, -1, -2),
            "age": self.age + dt[..., 0],
        }
        return TeamEstimate(*(changed.get(f.name, getattr(self, f.name)) for f in fields(self)))

    def take(self, env: int) -> TeamEstimate:
        """Return one environment, its axis removed."""
        arrays = (getattr(self, f.name)[env] for f in fields(self)[1:])
        return TeamEstimate(self.constellation, *arrays)
