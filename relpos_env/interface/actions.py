"""What a policy tells a car to do."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from gymnasium import spaces

from relpos_env.errors import EnvError
from tracking.arrays import F64


@dataclass(frozen=True, slots=True)
class DriveCommand:
    """Commands to every car of a group, (car)."""

    t: float
    """Time of the decision [s]."""
    speed: F64
    """Forward speed wanted [m/s]; negative is backwards."""
    steering: F64
    """Steering angle wanted [rad]; positive turns left."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ContinuousActions:
    """Two numbers in [-1, 1] a car: speed and steering as shares of their largest values."""

    max_speed: float = 2.0
    """[m/s]"""
    max_steering: float = 0.42
    """[rad]"""

    def space(self) -> spaces.Box:
        """The action space of one car."""
        return spaces.Box(-1.0, 1.0, shape=(2,), dtype=np.float32)

    def decode(self, t: float, actions: F64, agents: tuple[str, ...] = ()) -> DriveCommand:
        """Actions of every car, (car, 2), as commands. Values beyond the space are clipped.

        Raises:
            EnvError: Wrong shape, or not finite.
        """
        actions = np.asarray(actions, dtype=np.float64)
        if actions.ndim != 2 or actions.shape[1] != 2:
            raise EnvError(f"actions: expected shape (cars, 2), got {actions.shape}")
        bad = np.nonzero(~np.isfinite(actions).all(axis=1))[0]
        if len(bad):
            who = agents[bad[0]] if agents else f"car {bad[0]}"
            raise EnvError(f"action of {who}: expected finite numbers, got {actions[bad[0]]}")
        clipped = np.clip(actions, -1.0, 1.0)
        return DriveCommand(t, clipped[:, 0] * self.max_speed, clipped[:, 1] * self.max_steering)
