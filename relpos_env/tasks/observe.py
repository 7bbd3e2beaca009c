"""Task `observe`: go somewhere in formation, and drive so that the group can be tracked."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from relpos_env.tasks.geometry.shapes import Formation
from relpos_env.tasks.moving import Motion, MovingFormation
from relpos_env.tasks.travel import plan_travel
from tracking.arrays import F64, Bool

INFORMATION_SCALE = 0.1
"""[m] Expected error of a relative position at which the information term is exp(-1)."""


class Observe(MovingFormation):
    """A formation that follows a path, rewarded for small expected errors of its estimates."""

    reads_estimates = True

    def __init__(self, n_cars: int, n_envs: int, formation: Formation, motion: Motion) -> None:
        """Combine a formation and a motion, see `MovingFormation`."""
        super().__init__(n_cars, n_envs, formation, motion, more_terms=("information",))

    def inform(self, cov: F64, ok: Bool, envs: slice) -> None:
        """Write the information term: mean over the other present cars, 0 if not usable."""
        here = self._assigned[envs]
        both = here[:, :, None] & here[:, None] & ~np.eye(self.n_cars, dtype=bool)
        expected = np.sqrt(cov[envs, ..., 0] + cov[envs, ..., 1])
        gain = np.where(ok[envs] & both, np.exp(-expected / INFORMATION_SCALE), 0.0)
        self.rewards[envs, :, -1] = gain.sum(axis=-1) / np.maximum(both.sum(axis=-1), 1)


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
