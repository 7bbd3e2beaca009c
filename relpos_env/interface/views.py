"""What each car may know at one instant, whoever provides it: simulation or hardware."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tracking.arrays import F64, Bool
from tracking.estimate import TeamEstimate
from tracking.geometry import yaw_of


@dataclass(frozen=True, slots=True)
class TeamBelief:
    """Relative positions of all cars in the plane of the world, (car, other, ...).

    Made from the tracker's estimate, or from the truth for a mode that needs it.
    """

    pos_w: F64
    """Position of the other relative to the car, (car, other, 2) [m]."""
    vel_w: F64
    """Its velocity relative to the car, (car, other, 2) [m/s]."""
    pos_std: F64
    """Standard deviation of one position axis, (car, other) [m]; 0 for the truth."""
    ok: Bool
    """True where position and velocity can be used, (car, other)."""
    heading: F64
    """Heading of each car, (car) [rad]."""

    @classmethod
    def from_estimate(cls, estimate: TeamEstimate) -> TeamBelief:
        """The belief in an estimate of one group at one instant."""
        n = estimate.constellation.n_nodes
        pos, vel = np.zeros((n, n, 2)), np.zeros((n, n, 2))
        std, ok = np.zeros((n, n)), np.zeros((n, n), dtype=bool)
        i, j = estimate.constellation.pairs.T
        for a, b, sign in ((i, j, 1.0), (j, i, -1.0)):
            pos[a, b] = sign * estimate.pos_ij_w[:, :2]
            vel[a, b] = sign * estimate.vel_ij_w[:, :2]
            std[a, b] = np.sqrt(0.5 * np.sum(estimate.pos_std[:, :2] ** 2, axis=-1))
            ok[a, b] = estimate.ok
        return cls(pos, vel, std, ok, yaw_of(estimate.q_wb))

    @classmethod
    def from_truth(cls, pos_w: F64, vel_w: F64, heading: F64) -> TeamBelief:
        """The belief of an oracle, from true positions and velocities, (car, 2)."""
        n = len(pos_w)
        return cls(
            pos_w[None, :] - pos_w[:, None],
            vel_w[None, :] - vel_w[:, None],
            np.zeros((n, n)),
            ~np.eye(n, dtype=bool),
            heading.copy(),
        )


@dataclass(frozen=True, slots=True)
class AgentView:
    """What every car may know, each in its own frame: x forward, y left; (car, ...)."""

    pos_b: F64
    """Position of each other car, (car, other, 2) [m]."""
    vel_b: F64
    """Velocity of each other car relative to this one, (car, other, 2) [m/s]."""
    pos_std: F64
    """(car, other) [m]"""
    ok: Bool
    """(car, other)"""
    target_b: F64
    """Where each other car should be, (car, other, 2) [m]."""
    command_b: F64
    """Velocity that the operator asks of this car, (car, 2) [m/s]."""
    heading: F64
    """(car) [rad]"""
    speed: F64
    """Forward speed by the car's own odometer, (car) [m/s]."""
    steering: F64
    """Steering angle, (car) [rad]."""

    @classmethod
    def build(
        cls, belief: TeamBelief, target_w: F64, command_w: F64, speed: F64, steering: F64
    ) -> AgentView:
        """Put a belief and the task's wishes into the frame of every car.

        Args:
            belief: Relative positions in the world frame.
            target_w: Wanted relative positions, (car, other, 2) [m].
            command_w: Wanted velocities, (car, 2) [m/s].
            speed: Odometer, (car) [m/s].
            steering: Steering angle, (car) [rad].
        """
        c, s = np.cos(belief.heading), np.sin(belief.heading)
        R_bw = np.stack([np.stack([c, s], -1), np.stack([-s, c], -1)], axis=-2)  # noqa: N806

        def to_body(v: F64) -> F64:
            turned: F64 = np.einsum("...ab,...ob->...oa", R_bw, v)
            return turned

        return cls(
            pos_b=to_body(belief.pos_w),
            vel_b=to_body(belief.vel_w),
            pos_std=belief.pos_std,
            ok=belief.ok,
            target_b=to_body(target_w),
            command_b=to_body(command_w[:, None])[:, 0],
            heading=belief.heading,
            speed=speed,
            steering=steering,
        )
