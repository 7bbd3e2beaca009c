"""mpe2's time for a step: three point masses and three landmarks, nothing measured or tracked.

`simple_spread_v3.parallel_env(N=3)`, discrete actions drawn beforehand, with episodes as long as
ours instead of its 25 steps, which spares it resets.
"""

from __future__ import annotations

import os
import time
from importlib.metadata import version

import numpy as np

from agents.bench.env.effort import EPISODE


def mpe2_name() -> str | None:
    """The peer with its version; None where it is not installed."""
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")  # its greeting on standard output
    try:
        from mpe2 import simple_spread_v3  # noqa: F401
    except ImportError:
        return None
    return f"mpe2 {version('mpe2')} simple_spread_v3"


class Spread:
    """One environment of the peer, reset whenever its episode is over."""

    def __init__(self) -> None:
        from mpe2 import simple_spread_v3

        self._env = simple_spread_v3.parallel_env(N=3, max_cycles=EPISODE)
        self._env.reset(seed=0)
        numbers = np.random.default_rng(0).integers(5, size=(EPISODE, 3)).tolist()
        agents = self._env.possible_agents
        self._actions = [dict(zip(agents, row, strict=True)) for row in numbers]

    def turn(self, steps: int) -> float:
        """Time of so many steps and the resets among them [us per step]."""
        env, spent = self._env, 0.0
        for k in range(steps):
            actions = self._actions[k % EPISODE]
            began = time.perf_counter()
            env.step(actions)
            if not env.agents:
                env.reset()
            spent += time.perf_counter() - began
        return 1e6 * spent / steps
