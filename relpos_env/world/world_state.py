"""The truth about every car."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from tracking.arrays import F64, Bool
from tracking.params.short_repr import short_repr


@dataclass(frozen=True, slots=True, kw_only=True)
class WorldState:
    """Arrays over (env, car, ...), or over (car, ...) for one environment."""

    __repr__ = short_repr

    t: F64
    """Time since the environment began, (env) [s]."""
    pos_w: F64
    """(env, car, 2) [m]"""
    vel_w: F64
    """(env, car, 2) [m/s]"""
    accel_w: F64
    """Mean over the last step, (env, car, 2) [m/s2]."""
    heading: F64
    """(env, car) [rad]"""
    yaw_rate: F64
    """(env, car) [rad/s]"""
    steering: F64
    """(env, car) [rad]"""
    clearance: F64
    """Way between the car's body and the wall, box or car nearest to it, (env, car) [m]: 0 at a
    touch, at most 0.5."""
    present: Bool
    """The car is in the room, (env, car)."""

    @property
    def speed(self) -> F64:
        """Forward speed, (env, car) [m/s]."""
        forward: F64 = (
            np.cos(self.heading) * self.vel_w[..., 0] + np.sin(self.heading) * self.vel_w[..., 1]
        )
        return forward

    def take(self, env: int) -> WorldState:
        """One environment, its axis removed."""
        return WorldState(**{f.name: getattr(self, f.name)[env] for f in fields(self)})
