"""Task `observe`: go somewhere in formation, and drive so that the group can be tracked."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from relpos_env.tasks.base import InformedTask
from relpos_env.tasks.geometry.shapes import Formation
from relpos_env.tasks.moving import Motion, MovingFormation
from relpos_env.tasks.travel import plan_travel
from tracking.arrays import F64, Bool

INFORMATION_SCALE = 0.1
"""[m] Expected error of a relative position at which the information term is exp(-1)."""


def information_of(cov: F64, ok: Bool, present: Bool) -> F64:
    """Return exp(-expected error / `INFORMATION_SCALE`), 0 if unusable, of the others in the mean.

    Args:
        cov: Covariances xx, yy, xy of relative positions, (env, car, other, 3) [m2].
        ok: True for usable estimates, (env, car, other).
        present: True where the car is present, (env, car).
    """
    both = present[:, :, None] & present[:, None] & ~np.eye(present.shape[1], dtype=bool)
    expected = np.sqrt(cov[..., 0] + cov[..., 1])
    gain = np.where(ok & both, np.exp(-expected / INFORMATION_SCALE), 0.0)
    return np.asarray(gain.sum(axis=-1) / np.maximum(both.sum(axis=-1), 1))


class Observe(InformedTask, MovingFormation):
    """A formation that follows a path, rewarded for small expected errors of its estimates."""

    def __init__(self, n_cars: int, n_envs: int, formation: Formation, motion: Motion) -> None:
        """Combine a formation and a motion, see `MovingFormation`."""
        super().__init__(n_cars, n_envs, formation, motion, more_terms=("information",))

    def inform(self, cov: F64, ok: Bool, envs: slice) -> None:
        """Write the information term."""
        self.rewards[envs, :, -1] = information_of(cov[envs], ok[envs], self._assigned[envs])


def observe(
    n_cars: int,
    n_envs: int,
    room: tuple[float, float],
    *,
    shape: str | Sequence[Sequence[float]] | F64 = "triangle",
    spacing: float | None = None,
    speed: float = 0.7,
    path: str | Sequence[Sequence[float]] | F64 = "loop",
    closed: bool = False,
    turning: bool = False,
    heading: float = 0.0,
    lookahead: float = 0.3,
) -> Observe:
    """Build the task; options and errors are those of `travel`."""
    formation, motion = plan_travel(
        n_cars, room, shape, spacing, speed, path, closed, turning, heading, lookahead
    )
    return Observe(n_cars, n_envs, formation, motion)
