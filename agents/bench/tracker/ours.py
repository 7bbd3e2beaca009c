"""Times of the tracker: a step of an initialised group, and an hour of a recording."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from math import ceil

import numpy as np

from agents.bench.tracker.workload import Workload
from tracking.estimate import Status
from tracking.log import Log
from tracking.tracker import Tracker

REPEATS = 5
"""[-] Number of timed runs, of which the fastest counts."""
STARTING = 5.0
"""[s] Length of the initialisation at the beginning of a recording."""
WARM_UP, PATIENCE = 15.0, 60.0
"""[s] Shortest and longest time until one hypothesis is left."""
FIRST_ROUNDS = 10
"""[-] Rounds to initialise the group."""


def step_cost(workload: Workload, name: str, steps: int) -> float:
    """Return the time of a step with a single hypothesis [us].

    Args:
        workload: The group and its steps.
        name: Filter, one of `tracking.filters.FILTERS`.
        steps: Number of timed steps.

    Raises:
        RuntimeError: The group is not initialised in time.
    """
    tracker, done = started(workload, name)
    chunk = workload.block(done, steps)
    end = float(chunk.t[0, -1])
    saved = tracker.save()
    best = np.inf
    for _ in range(REPEATS):
        tracker.restore(saved)
        began = time.perf_counter()
        tracker.step(chunk, end)
        best = min(best, time.perf_counter() - began)
    return 1e6 * float(best) / steps


def started(workload: Workload, name: str) -> tuple[Tracker, int]:
    """Return an initialised tracker with a single hypothesis, and the index of the next step.

    Raises:
        RuntimeError: The group is not initialised in time.
    """
    tracker = Tracker(workload.constellation, filter=name)
    # The first steps are rounds over all pairs for any workload.
    rounds = replace(workload, step="round")
    first = rounds.block(0, FIRST_ROUNDS)
    until = float(first.t[0, -1])
    tracker.step(first, until)
    done = ceil(until / workload.dt)
    second = max(round(1.0 / workload.dt), 1)
    while done * workload.dt < PATIENCE:
        chunk = workload.block(done, second)
        estimate = tracker.step(chunk, float(chunk.t[0, -1]))
        done += second
        enough = (estimate.status > Status.AMBIGUOUS).all() if name == "joint" else True
        if done * workload.dt > WARM_UP and enough:
            return tracker, done
    raise RuntimeError(f"bench: {workload.n} nodes did not start within {PATIENCE:g} s")


@dataclass(frozen=True)
class HourCost:
    """Cost of an hour of a recording."""

    seconds: float
    """[s] Time to process it, orientation filters included."""
    rounds: float
    """[-] Ranging rounds per hour."""


def hour_cost(log: Log) -> HourCost:
    """Return the cost of an hour, extrapolated from a shorter recording, at ten estimates/s.

    The initialisation, which has many hypotheses, is not extrapolated.
    """
    first, last = float(log.block.t[0, 0]), float(log.block.t[0, -1])
    split = int(np.searchsorted(log.block.t[0], first + STARTING))
    parts = log.block.take(slice(0, split)), log.block.take(slice(split, None))
    t_out = np.arange(first + STARTING, last, 0.1)
    best = np.full(2, np.inf)
    for _ in range(3):
        tracker = Tracker(log.constellation)
        for k, (part, at) in enumerate(zip(parts, (t_out[:1], t_out), strict=True)):
            began = time.perf_counter()
            tracker.run(part, at)
            best[k] = min(best[k], time.perf_counter() - began)
    share = (3600.0 - STARTING) / (last - first - STARTING)
    rounds = 3600.0 * log.n_ranges / log.constellation.n_pairs / log.duration
    return HourCost(float(best[0] + best[1] * share), rounds)
