"""Peer mpe2: three point masses and three landmarks, without sensors or tracking.

`simple_spread_v3.parallel_env(N=3)` with discrete actions sampled beforehand. Its episodes are as
long as ours, instead of 25 steps, so it has fewer resets.
"""

from __future__ import annotations

import os
import time
from importlib.metadata import version

import numpy as np

from agents.bench.env.effort import EPISODE


def mpe2_name() -> str | None:
    """Return the name of the peer with its version; None if it is not installed."""
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")  # its greeting on standard output
    try:
        from mpe2 import simple_spread_v3  # noqa: F401
    except ImportError:
        return None
    return f"mpe2 {version('mpe2')} simple_spread_v3"


class Spread:
    """One environment of the peer, reset after every episode."""

    def __init__(self) -> None:
        from mpe2 import simple_spread_v3

        self._env = simple_spread_v3.parallel_env(N=3, max_cycles=EPISODE)
        self._env.reset(seed=0)
        numbers = np.random.default_rng(0).integers(5, size=(EPISODE, 3)).tolist()
        agents = self._env.possible_agents
        self._actions = [dict(zip(agents, row, strict=True)) for row in numbers]

    def turn(self, steps: int) -> float:
        """Run `steps` steps with their resets; return the time [us per step]."""
        env, spent = self._env, 0.0
        for k in range(steps):
            actions = self._actions[k % EPISODE]
            began = time.perf_counter()
            env.step(actions)
            if not env.agents:
                env.reset()
            spent += time.perf_counter() - began
        return 1e6 * spent / steps
