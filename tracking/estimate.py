"""What the tracker believes: relative positions of every pair, and how sure it is."""

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
    """How far a pair's estimate can be used."""

    ABSENT = 0
    """One of the two is not in the group."""
    STARTING = 1
    """Not enough measurements yet; position and covariance say nothing."""
    AMBIGUOUS = 2
    """The shape is known, its rotation or mirror image is not."""
    OK = 3
    """Position, velocity and covariance hold, within the accuracy that is asked for."""
    LOST = 4
    """No range for so long that the position is dead reckoning, or one less certain than the
    accuracy that is asked for (`VehicleParams.accuracy`)."""
    DOUBTFUL = 5
    """Its ranges contradict all else: a liar, a wrong calibration, or a filter gone astray."""


@dataclass(frozen=True, slots=True)
class TeamEstimate:
    """Estimates of all pairs, arrays over (..., pair).

    The leading axes are (env,) for one instant and (env, time) for a run. Pairs are those of
    `Constellation.pairs`; `between` gives either order.
    """

    __repr__ = short_repr

    constellation: Constellation
    t: F64
    """Time the estimate is for, (...) [s]."""
    pos_ij_w: F64
    """p_j - p_i, (..., pair, 3) [m]."""
    vel_ij_w: F64
    """v_j - v_i, (..., pair, 3) [m/s]."""
    cov: F64
    """Covariance of position and velocity, (..., pair, 6, 6); zero across a plane."""
    q_wb: F64
    """Orientation of each node, (..., node, 4)."""
    has_orientation: Bool
    """True where `q_wb` came from measurements, (..., node)."""
    age: F64
    """Time since the last range, (..., pair) [s]; 0 before the first."""
    nis: F64
    """Normalised innovation squared of the last range, (..., pair) [-]."""
    nlos_prob: F64
    """Probability that the last range was not line of sight, (..., pair) [-]; 0 from filters
    that do not estimate it."""
    status: I64
    """A `Status`, (..., pair)."""

    @classmethod
    def empty(cls, constellation: Constellation, t: F64) -> TeamEstimate:
        """Zeros for the given times, (...), to be filled."""
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
        """The fields but the time in their order, as kernels take them."""
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
        """Arrays over (env, 1, ...) that share the memory of these over (env, ...)."""
        return TeamEstimate(
            self.constellation, self.t[:, None], *(array[:, None] for array in self.arrays)
        )

    @property
    def ok(self) -> Bool:
        """True where the estimate can be used as it is, (..., pair)."""
        return np.asarray(self.status == Status.OK)

    @property
    def pos_std(self) -> F64:
        """Standard deviation of each position axis, (..., pair, 3) [m]."""
        return np.sqrt(np.diagonal(self.cov, axis1=-2, axis2=-1)[..., :3])

    def between(self, i: int, j: int) -> tuple[F64, F64]:
        """Position and velocity of node j relative to node i in the world frame, each (..., 3).

        Raises:
            ConfigError: They are one.
        """
        if i == j:
            raise ConfigError(f"between: expected two different nodes, got {i} twice")
        pair = self.constellation.pair_index[i, j]
        sign = 1.0 if i < j else -1.0
        return sign * self.pos_ij_w[..., pair, :], sign * self.vel_ij_w[..., pair, :]

    def between_b(self, i: int, j: int) -> tuple[F64, F64]:
        """Position and velocity of node j relative to node i in i's body frame, each (..., 3)."""
        pos_w, vel_w = self.between(i, j)
        R_bw = np.swapaxes(quat_to_matrix(self.q_wb[..., i, :]), -1, -2)  # noqa: N806
        return (R_bw @ pos_w[..., None])[..., 0], (R_bw @ vel_w[..., None])[..., 0]

    def relative_orientation(self, i: int, j: int) -> F64:
        """q_ij = q_i^-1 q_j, the orientation of j's body in i's body frame, (..., 4)."""
        return quat_multiply(quat_conjugate(self.q_wb[..., i, :]), self.q_wb[..., j, :])

    def at(self, t: F64 | float) -> TeamEstimate:
        """The estimate carried to another time at constant velocity.

        The covariance is carried with it, without process noise: meant for the tenth of a
        second between the tracker's delayed horizon and now.
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
        """One environment, its axis removed."""
        arrays = (getattr(self, f.name)[env] for f in fields(self)[1:])
        return TeamEstimate(self.constellation, *arrays)
