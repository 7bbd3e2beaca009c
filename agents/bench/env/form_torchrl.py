"""Timing of the TorchRL form of a batch."""

from __future__ import annotations

import time
from importlib.util import find_spec
from math import ceil

import numpy as np

from agents.bench.env.batch import SCENARIO, TASK
from agents.bench.env.drives import Drive
from agents.bench.env.effort import EPISODE


def has_torchrl() -> bool:
    """True if TorchRL is installed."""
    return find_spec("torchrl") is not None


class TorchBatch:
    """Environments with evenly spread episode phases, as `Batch`, stepped as collectors do."""

    def __init__(self, n_envs: int, drive: Drive, *, resets: int) -> None:
        from relpos_env.api.torchrl_env import FormationTorchEnv

        self._env = FormationTorchEnv(
            n_envs, scenario=SCENARIO, task=TASK, n_cars=3, max_cycles=EPISODE
        )
        self._n_envs, self._drive = n_envs, drive
        self._steps = ceil(EPISODE * resets / n_envs)
        self._env.set_seed(0)
        self._at = self._env.reset()
        self._env.formation.cycles[:] = EPISODE * np.arange(n_envs) // n_envs

    def warm_up(self, steps: int) -> None:
        """Drive for a number of steps."""
        for _ in range(steps):
            self._step()

    def turn(self) -> float:
        """Run a turn; return its time [us per env-step]."""
        spent = sum(self._step() for _ in range(self._steps))
        return 1e6 * spent / (self._steps * self._n_envs)

    def close(self) -> None:
        """Release the threads."""
        self._env.close()

    def _step(self) -> float:
        import torch

        action = torch.from_numpy(self._drive(self._env.formation).astype(np.float32))
        began = time.perf_counter()
        self._at.set(("agents", "action"), action)
        _, self._at = self._env.step_and_maybe_reset(self._at)
        return time.perf_counter() - began
