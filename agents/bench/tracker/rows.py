"""Figures of `relpos bench tracker`, each with a peer."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from agents.bench.tracker.ours import hour_cost, step_cost
from agents.bench.tracker.peer_filterpy import filterpy_name, group_cost, pairs_cost
from agents.bench.tracker.peer_gtsam import gtsam_name, smoother_cost
from agents.bench.tracker.workload import Workload
from tracking.filters import DEFAULT_FILTER, FILTERS

Row = dict[str, Any]
CARS, PEOPLE = Workload(3, 2, "round"), Workload(6, 3, "round")
"""Cars and body trackers of the paper: three nodes in 2D, six in 3D."""
SIX_CARS = Workload(6, 2, "round")
BODY_HOUR = "1 h of 6 nodes 3D, with VQF"


def bench_tracker(
    *,
    rounds: int = 2000,
    progress: Callable[[float], None] | None = None,
    tell: Callable[[str], None] | None = None,
) -> list[Row]:
    """Measure the tracker against filterpy, and against GTSAM if it is installed.

    Args:
        rounds: Timed steps per figure of small groups; fewer for large groups and peers.
        progress: Called with the share done, 0 to 1.
        tell: Called with a note if a peer is not installed.

    Raises:
        UsageError: filterpy is not installed.
    """
    filterpy, gtsam = filterpy_name(), gtsam_name()
    if gtsam is None and tell is not None:
        tell("bench: gtsam is not installed, its rows are left out")
    rows: list[Row] = []
    jobs: list[Callable[[], list[Row]]] = [
        lambda: _rounds(CARS, rounds, filterpy, gtsam),
        lambda: _rounds(SIX_CARS, rounds, filterpy, gtsam),
        lambda: _rounds(PEOPLE, rounds, filterpy, gtsam),
        lambda: _message(20, rounds, filterpy),
        lambda: _message(50, rounds, filterpy),
        lambda: [_hour(rounds, filterpy)],
    ]
    for k, job in enumerate(jobs):
        rows += job()
        if progress is not None:
            progress((k + 1) / len(jobs))
    return rows


def _rounds(workload: Workload, rounds: int, filterpy: str, gtsam: str | None) -> list[Row]:
    """Measure one prediction and a range of every pair, for every filter and its peers."""
    few = max(rounds // 20, 20)
    pairs, group = pairs_cost(workload, few), group_cost(workload, few)
    where = f"{workload.n} nodes {workload.dimensions}D"
    rows = []
    for name in FILTERS:
        ours = step_cost(workload, name, rounds)
        case = f"{name}, {where}, {workload.constellation.n_pairs} ranges"
        if name != DEFAULT_FILTER:
            rows.append(_row(case, ours, "us", f"{filterpy}, pairs", pairs))
            continue
        rows.append(_row(case, ours, "us", filterpy, group))
        if gtsam is not None:
            rows.append(_row(case, ours, "us", gtsam, smoother_cost(workload, few)))
    return rows


def _message(n: int, rounds: int, filterpy: str) -> list[Row]:
    """Measure one prediction and the ranges of a message in a large group of cars."""
    workload = Workload(n, 2, "message")
    ours = step_cost(workload, DEFAULT_FILTER, max(rounds // 10, 50))
    case = f"{DEFAULT_FILTER}, {n} nodes 2D, {workload.pairs.shape[1]} ranges"
    theirs = group_cost(workload, max(rounds // 1000, 1))
    return [_row(case, ours, "us", filterpy, theirs)]


def _hour(rounds: int, filterpy: str) -> Row:
    """Measure a recording of a person; the peer has its rounds, without orientation filters."""
    from agents.simulation.simulate import simulate

    seconds = min(max(0.03 * rounds, 10.0), 60.0)
    hour = hour_cost(simulate(scenario="human", seconds=seconds))
    theirs = 1e-6 * group_cost(PEOPLE, max(rounds // 20, 20)) * hour.rounds
    return _row(BODY_HOUR, hour.seconds, "s", f"{filterpy}, no VQF", theirs)


def _row(case: str, value: float, unit: str, peer: str, peer_value: float) -> Row:
    return {
        "bench": "tracker",
        "case": case,
        "value": value,
        "unit": unit,
        "peer": peer,
        "peer_value": peer_value,
        "ratio": peer_value / value,
    }
