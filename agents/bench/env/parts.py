"""Profile of a step: times of the methods of the environment."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from typing import Any
from unittest.mock import patch

from agents.bench.env.batch import Batch
from relpos_env.core.env_core import EnvCore
from relpos_env.sensors.operator import Operator
from relpos_env.tasks.base import Task
from relpos_env.timing import DECISION, DT
from relpos_env.world.world import World

RESETS = "resets"
METHODS: tuple[tuple[str, type, str], ...] = (
    ("cars, sensors, radio", World, "step"),
    ("task, operator", Task, "update"),
    ("task, operator", Operator, "sample"),
    ("observations", EnvCore, "_observe"),
    (RESETS, EnvCore, "begin"),
)
"""Name of the part, and class and name of the timed method."""
BOUND: tuple[tuple[str, str], ...] = (
    ("horizon", "_wait"),
    ("orientation", "_orient"),
    ("filter", "_follow"),
    ("view", "_turn"),
    ("view", "_see"),
)
"""Name of the part, and of the timed function of a `Perception`."""
REST = "rest"
"""Checks, copies, infos, and Python code between the parts."""


@dataclass(frozen=True)
class Parts:
    """Times of the parts of a step in the best turn of a batch."""

    total: float
    """[us per env-step] Time of all parts."""
    cost: dict[str, float]
    """[us per env-step] Time of each part."""
    solver_share: float
    """[-] Share of sub-steps that need the rigid-body solver because of possible contacts."""


@dataclass
class _Stopwatch:
    """Times by part; nested parts count for the outermost one."""

    swarm: World
    spent: dict[str, float] = field(default_factory=dict)
    moves_of_resets: int = 0
    """[-] Solver steps during resets."""
    _running: str = ""

    @contextmanager
    def running(self, name: str) -> Iterator[None]:
        if self._running:
            yield
            return
        self._running = name
        moves, began = self.swarm.solver_moves, time.perf_counter()
        try:
            yield
        finally:
            self.spent[name] = self.spent.get(name, 0.0) + time.perf_counter() - began
            self._running = ""
            if name == RESETS:
                self.moves_of_resets += self.swarm.solver_moves - moves

    def round(self, function: Callable[..., Any], name: str) -> Callable[..., Any]:
        """Return the function with a timer for a part."""

        def timed(*args: Any, **kwargs: Any) -> Any:
            with self.running(name):
                return function(*args, **kwargs)

        return timed


def parts_of(batch: Batch, turns: int = 1) -> Parts:
    """Return the times of the parts in the best turn of a batch with one thread.

    The timers add less than 1 us per call, once per step of the whole batch.

    Args:
        batch: Batch after its warm-up.
        turns: Number of turns.
    """
    return min((_turn(batch) for _ in range(turns)), key=lambda parts: parts.total)


def _turn(batch: Batch) -> Parts:
    swarm = batch.env.formation.loop.swarm
    watch, moves = _Stopwatch(swarm), swarm.solver_moves
    with ExitStack() as patches:
        for name, owner, method in METHODS:
            timed = watch.round(getattr(owner, method), name)
            patches.enter_context(patch.object(owner, method, timed))
        perception = batch.env.formation.loop.perception
        for name, function in BOUND:
            timed = watch.round(getattr(perception, function), name)
            patches.enter_context(patch.object(perception, function, timed))
        total = batch.turn()
    env_steps = batch.steps * batch.n_envs
    cost = dict.fromkeys([name for name, *_ in METHODS] + [name for name, _ in BOUND], 0.0)
    cost |= {name: 1e6 * spent / env_steps for name, spent in watch.spent.items()}
    cost[REST] = total - sum(cost.values())
    moves = swarm.solver_moves - moves - watch.moves_of_resets
    return Parts(total, cost, moves / (env_steps * round(DECISION / DT)))
