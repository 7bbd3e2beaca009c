"""Timing of one PettingZoo environment of ours."""

from __future__ import annotations

import time

from agents.bench.env.batch import SCENARIO, TASK
from agents.bench.env.drives import Drive
from agents.bench.env.effort import EPISODE
from relpos_env import formation_v0


class Single:
    """A `parallel_env` that is reset after every episode."""

    def __init__(self, drive: Drive) -> None:
        self._env = formation_v0.parallel_env(
            scenario=SCENARIO, task=TASK, n_cars=3, max_cycles=EPISODE
        )
        self._drive = drive
        self._env.reset(seed=0)

    def turn(self, steps: int) -> float:
        """Run `steps` steps with their resets; return the time [us per step]."""
        env, spent = self._env, 0.0
        for _ in range(steps):
            rows = self._drive(env.formation)[0]
            actions = {agent: rows[k] for k, agent in enumerate(env.possible_agents)}
            began = time.perf_counter()
            env.step(actions)
            if not env.agents:
                env.reset()
            spent += time.perf_counter() - began
        return 1e6 * spent / steps
