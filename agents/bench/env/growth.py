"""Time and memory over the number of environments and of cars."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable
from dataclasses import dataclass

from agents.bench.env.batch import SCENARIO, Batch
from agents.bench.env.drives import followed
from agents.bench.env.effort import EPISODE, Effort
from agents.bench.env.memory import array_bytes, resident_bytes

WIDE = "open"
"""Scenario of the curve over cars, whose ring has space for twenty."""
RESETS = 2
"""[-] Resets per turn; large batches have more, for `LEAST_STEPS` steps per turn."""
LEAST_STEPS = 5


@dataclass(frozen=True, slots=True, kw_only=True)
class Point:
    """One point of a curve."""

    scenario: str
    n_envs: int
    n_cars: int
    cost: float
    """[us per env-step] Time with one thread."""
    array_bytes: float
    """[byte] Size of the arrays per environment."""
    resident_bytes: float | None
    """[byte] Growth of the resident memory per environment; None if the system does not report it.
    Small batches may fit into memory that the process already has."""


def growth(effort: Effort, *, progress: Callable[[float], None] | None = None) -> list[Point]:
    """Measure the curve over environments with three cars, then the curve over cars.

    Args:
        effort: Sizes, turns and time limit of a point.
        progress: Called with the share done, 0 to 1.
    """
    cases = [(SCENARIO, e, 3) for e in effort.growth_envs]
    cases += [(WIDE, effort.envs, n) for n in effort.growth_cars]
    points = []
    for k, (scenario, n_envs, n_cars) in enumerate(cases):
        points.append(_point(scenario, n_envs, n_cars, effort))
        if progress is not None:
            progress((k + 1) / len(cases))
    return points


def _point(scenario: str, n_envs: int, n_cars: int, effort: Effort) -> Point:
    gc.collect()
    before = resident_bytes()
    resets = max(RESETS, LEAST_STEPS * n_envs // EPISODE)
    batch = Batch(n_envs, followed, resets=resets, scenario=scenario, n_cars=n_cars)
    batch.warm_up(effort.warm_up)
    cost, until = batch.turn(), time.perf_counter() + effort.patience
    for _ in range(effort.turns - 1):
        if time.perf_counter() > until:
            break
        cost = min(cost, batch.turn())
    after = resident_bytes()
    grown = None if before is None or after is None else max(after - before, 0) / n_envs
    held = array_bytes(batch.env.formation) / n_envs
    batch.close()
    return Point(
        scenario=scenario,
        n_envs=n_envs,
        n_cars=n_cars,
        cost=cost,
        array_bytes=held,
        resident_bytes=grown,
    )
