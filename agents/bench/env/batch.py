"""Our batch of environments in one process, timed over turns of whole episodes."""

from __future__ import annotations

import time
from math import ceil

import numpy as np

from agents.bench.env.drives import Drive
from agents.bench.env.effort import EPISODE
from relpos_env.api.vector_env import FormationVectorEnv
from relpos_env.world.world import Physics

SCENARIO, TASK = "ring-los", "ring"


class Batch:
    """Environments with evenly spread episode phases.

    A turn therefore has `resets` resets in total, spread evenly over its steps.
    """

    def __init__(
        self,
        n_envs: int,
        drive: Drive,
        *,
        resets: int,
        scenario: str = SCENARIO,
        n_cars: int = 3,
        threads: int = 1,
        physics: Physics = "fast",
    ) -> None:
        self.env = FormationVectorEnv(
            n_envs,
            scenario=scenario,
            task=TASK,
            n_cars=n_cars,
            threads=threads,
            max_cycles=EPISODE,
            physics=physics,
            autoreset_mode="SameStep",
        )
        self.n_envs, self._drive = n_envs, drive
        self.steps = ceil(EPISODE * resets / n_envs)
        """[-] Steps of a turn."""
        self.env.reset(seed=0)
        self.env.formation.cycles[:] = EPISODE * np.arange(n_envs) // n_envs

    def warm_up(self, steps: int) -> None:
        """Drive for a number of steps."""
        for _ in range(steps):
            self._step()

    def turn(self) -> float:
        """Run a turn; return its time [us per env-step]."""
        spent = sum(self._step() for _ in range(self.steps))
        return 1e6 * spent / (self.steps * self.n_envs)

    def close(self) -> None:
        """Release the threads."""
        self.env.close()

    def _step(self) -> float:
        actions = self._drive(self.env.formation).reshape(self.n_envs, -1)
        began = time.perf_counter()
        self.env.step(actions)
        return time.perf_counter() - began
