"""True state of every car."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from tracking.arrays import F64, Bool
from tracking.params.short_repr import short_repr


@dataclass(frozen=True, slots=True, kw_only=True)
class WorldState:
    """True state, arrays over (env, car, ...), or over (car, ...) for one environment."""

    __repr__ = short_repr

    t: F64
    """Time since the environment began, (env) [s]."""
    pos_w: F64
    """Position, (env, car, 2) [m]."""
    vel_w: F64
    """Velocity, (env, car, 2) [m/s]."""
    accel_w: F64
    """Mean acceleration over the last step, (env, car, 2) [m/s2]."""
    heading: F64
    """Heading, (env, car) [rad]."""
    yaw_rate: F64
    """Yaw rate, (env, car) [rad/s]."""
    steering: F64
    """Angle of the front wheels, (env, car) [rad]."""
    clearance: F64
    """Distance between the car's body and the nearest wall, box or car, (env, car) [m]: 0 at a
    contact, at most 0.5."""
    present: Bool
    """True if the car is in the room, (env, car)."""

    @property
    def speed(self) -> F64:
        """Forward speed, (env, car) [m/s]."""
        forward: F64 = (
            np.cos(self.heading) * self.vel_w[..., 0] + np.sin(self.heading) * self.vel_w[..., 1]
        )
        return forward

    def take(self, env: int) -> WorldState:
        """Return one environment without its axis."""
        return WorldState(**{f.name: getattr(self, f.name)[env] for f in fields(self)})
