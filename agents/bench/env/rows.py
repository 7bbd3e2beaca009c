"""Figures of `relpos bench env`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from agents.bench.env.batch import SCENARIO, Batch
from agents.bench.env.drives import Chance, Drive, followed
from agents.bench.env.effort import EPISODE, FULL, Effort
from agents.bench.env.form_torchrl import TorchBatch, has_torchrl
from agents.bench.env.growth import Point, growth
from agents.bench.env.parts import parts_of
from agents.bench.env.peer_mpe2 import Spread, mpe2_name
from agents.bench.env.peer_pymunk import Rooms, pymunk_name
from agents.bench.env.single import Single
from agents.bench.env.turns import best_of_turns
from agents.bench.env.two_processes import processes_cost

Row = dict[str, Any]
CURVES_FROM = 0.6
"""[-] Share done when the curves begin."""
NLOS = "ring-nlos"
"""Scenario of the same room with a wall."""
DRIVES: dict[str, Callable[[], Drive]] = {"followed": lambda: followed, "by chance": Chance}
"""Drivers: following the task, and random with frequent contacts, which keeps the solver busy."""


def bench_env(
    effort: Effort = FULL,
    *,
    progress: Callable[[float], None] | None = None,
    tell: Callable[[str], None] | None = None,
) -> list[Row]:
    """Measure env-steps against mpe2 and pymunk, on two cores, over batch sizes, and by part.

    Args:
        effort: Size of the run.
        progress: Called with the share done, 0 to 1.
        tell: Called with a note if a peer is not installed.
    """
    rows: list[Row] = []

    def curve(share: float) -> None:
        if progress is not None:
            progress(CURVES_FROM + (1.0 - CURVES_FROM) * share)

    jobs: list[Callable[[], list[Row]]] = [
        lambda: [_single(effort, tell)],
        lambda: _batch(effort, SCENARIO, "followed"),
        lambda: _batch(effort, SCENARIO, "by chance"),
        lambda: _batch(effort, NLOS, "followed"),
        lambda: [_kept(effort)],
        lambda: _torchrl(effort, tell),
        lambda: _threads(effort),
        lambda: [_processes(effort, rows)],
        lambda: [_curve_row(point) for point in growth(effort, progress=curve)],
    ]
    for k, job in enumerate(jobs):
        rows += job()
        if progress is not None:
            done = k + 1
            progress(1.0 if done == len(jobs) else CURVES_FROM * done / (len(jobs) - 1))
    return rows


def _single(effort: Effort, tell: Callable[[str], None] | None) -> Row:
    """Measure one environment with the PettingZoo interface against mpe2."""
    steps, peer = EPISODE * effort.resets, mpe2_name()
    ours = Single(followed)
    ours.turn(effort.warm_up)
    jobs = [lambda: ours.turn(steps)]
    if peer is not None:
        theirs = Spread()
        theirs.turn(effort.warm_up)
        jobs.append(lambda: theirs.turn(steps))
    elif tell is not None:
        tell("bench: mpe2 is not installed, its figure is left out")
    cost, *others = best_of_turns(jobs, effort.turns)
    return _row(
        "parallel_env, followed", cost, envs=1, peer=peer, peer_cost=next(iter(others), None)
    )


def _batch(effort: Effort, name: str, drive: str) -> list[Row]:
    """Measure a batch on one core against pymunk, and its parts."""
    ours = Batch(effort.envs, DRIVES[drive](), resets=effort.resets, scenario=name)
    ours.warm_up(effort.warm_up)
    theirs = Rooms(effort.envs, resets=effort.resets, name=name)
    cost, peer_cost = best_of_turns([ours.turn, theirs.turn], effort.turns)
    parts = parts_of(ours, effort.turns)
    ours.close()
    what = f"{name}, {drive}"
    row = _row(what, cost, envs=effort.envs, peer=pymunk_name(), peer_cost=peer_cost)
    row["solver_share"] = parts.solver_share
    return [row] + [
        _row(f"{what}: {part}", spent, envs=effort.envs) for part, spent in parts.cost.items()
    ]


def _kept(effort: Effort) -> Row:
    """Measure a batch that always uses the rigid-body solver, against pymunk."""
    ours = Batch(effort.envs, followed, resets=effort.resets, physics="pymunk")
    ours.warm_up(effort.warm_up)
    theirs = Rooms(effort.envs, resets=effort.resets, name=SCENARIO)
    cost, peer_cost = best_of_turns([ours.turn, theirs.turn], effort.turns)
    ours.close()
    what = f"{SCENARIO}, followed, physics pymunk"
    return _row(what, cost, envs=effort.envs, peer=pymunk_name(), peer_cost=peer_cost)


def _torchrl(effort: Effort, tell: Callable[[str], None] | None) -> list[Row]:
    """Measure the TorchRL form of a batch against the batch."""
    if not has_torchrl():
        if tell is not None:
            tell("bench: torchrl is not installed, its figure is left out")
        return []
    bare = Batch(effort.envs, followed, resets=effort.resets)
    ours = TorchBatch(effort.envs, followed, resets=effort.resets)
    for batch in (bare, ours):
        batch.warm_up(effort.warm_up)
    cost, peer_cost = best_of_turns([ours.turn, bare.turn], effort.turns)
    for batch in (bare, ours):
        batch.close()
    what = f"{SCENARIO}, followed, FormationTorchEnv"
    return [_row(what, cost, envs=effort.envs, peer="FormationVectorEnv", peer_cost=peer_cost)]


def _threads(effort: Effort) -> list[Row]:
    """Measure two threads against one thread, and against pymunk with one thread."""
    rows = []
    for n_envs in effort.two_cores:
        one, two = (Batch(n_envs, followed, resets=effort.resets, threads=k) for k in (1, 2))
        theirs = Rooms(n_envs, resets=effort.resets, name=SCENARIO)
        for batch in (one, two):
            batch.warm_up(effort.warm_up)
        alone, cost, bare = best_of_turns([one.turn, two.turn, theirs.turn], effort.turns)
        one.close()
        two.close()
        for peer, peer_cost in (("one thread", alone), (pymunk_name(), bare)):
            rows.append(
                _row("two threads", cost, envs=n_envs, threads=2, peer=peer, peer_cost=peer_cost)
            )
    return rows


def _processes(effort: Effort, rows: list[Row]) -> Row:
    """Measure two processes against the single thread of `rows`."""
    n_envs = effort.two_cores[0]
    cost = processes_cost(
        n_envs, 2, resets=effort.resets, warm_up=effort.warm_up, turns=effort.turns
    )
    alone = next(r for r in rows if r["what"] == "two threads")
    peer_cost = alone["us_per_env_step"] * alone["ratio"]
    return _row(
        "two processes, actions made in them",
        cost,
        envs=2 * n_envs,
        processes=2,
        peer="one thread",
        peer_cost=peer_cost,
    )


def _curve_row(point: Point) -> Row:
    row = _row(f"growth, {point.scenario}", point.cost, envs=point.n_envs, cars=point.n_cars)
    return row | {
        "array_bytes_per_env": point.array_bytes,
        "resident_bytes_per_env": point.resident_bytes,
    }


def _row(
    what: str,
    cost: float,
    *,
    envs: int,
    cars: int = 3,
    threads: int = 1,
    processes: int = 1,
    peer: str | None = None,
    peer_cost: float | None = None,
) -> Row:
    """Return a row of figures; the ratio is ours over the peer's in env-steps/s."""
    return {
        "bench": "env",
        "what": what,
        "envs": envs,
        "cars": cars,
        "threads": threads,
        "processes": processes,
        "env_steps_per_s": 1e6 / cost if cost > 0.0 else None,
        "us_per_env_step": cost,
        "peer": peer,
        "ratio": None if peer_cost is None else peer_cost / cost,
    }
