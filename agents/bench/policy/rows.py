"""Figures of `relpos bench policy`."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from agents.bench.env.turns import best_of_turns
from agents.bench.policy.perceptron import HIDDEN, Perceptron
from agents.driver import Driver
from agents.policies import load_policy, shipped_names
from agents.policies.layout import Layout
from agents.policies.padding import PaddedDriver
from relpos_env.config import configure
from relpos_env.core.env_core import EnvCore
from relpos_env.interface.observations.base import F32

Row = dict[str, Any]
SCENARIO, SLOTS, BATCH = "cars-nlos", 6, 64
"""Scenario with three cars, slots of the policy, and environments of the batch."""
TURNS = 7
SETTLE = 50
"""[-] Control steps before the observations are taken, enough for trackers to initialise."""
SAME = 1e-5
"""[-] Tolerance of actions, for the different order of summation."""


def bench_policy(
    *, steps: int = 2000, progress: Callable[[float], None] | None = None
) -> list[Row]:
    """Measure policies, with and without computing the observations, against numpy.

    Args:
        steps: Calls per turn; fewer for batches.
        progress: Called with the share done, 0 to 1.

    Raises:
        UsageError: onnx is not installed.
    """
    formation = _room()
    seen = Layout.of(formation.parts)
    required = Layout(seen.observation, SLOTS)
    peer, own = Perceptron(required), Perceptron(seen)
    one = formation.observations[0, 0].copy()
    many = np.tile(formation.observations, (BATCH, 1, 1))
    drivers: dict[str, tuple[Driver, Driver, F32, int]] = {
        "one car": (own.policy(), own, one, steps),
        f"one car of {SLOTS} slots, three cars": (
            peer.policy().driver(seen), PaddedDriver(peer, required, seen), one, steps,
        ),
        f"{BATCH * 3} cars": (own.policy(), own, many, max(steps // 20, 1)),
    }  # fmt: skip
    rows: list[Row] = []
    for case, (ours, theirs, observations, n) in drivers.items():
        _same(ours, theirs, observations)
        jobs = [_turn(partial(driver.act, observations), n) for driver in (ours, theirs)]
        rows.append(_row(f"act, {case}", *best_of_turns(jobs, TURNS)))
        if progress is not None:
            progress(len(rows) / (len(drivers) + 1))
    ours, theirs, _, n = drivers[f"one car of {SLOTS} slots, three cars"]
    jobs = [_turn(_decision(formation, driver), n) for driver in (ours, theirs)]
    rows.append(_row("observation and act, the same", *best_of_turns(jobs, TURNS)))
    for name in shipped_names():
        policy = load_policy(name)
        room = _room(policy.layout.proximity)
        decisions = (
            _decision(room, policy.driver(Layout.of(room.parts))),
            _decision(formation, theirs),
        )
        jobs = [_turn(decide, n) for decide in decisions]
        rows.append(_row(f"observation and act, policy {name}", *best_of_turns(jobs, TURNS)))
    if progress is not None:
        progress(1.0)
    return rows


def _room(proximity: int = 0) -> EnvCore:
    """Return an environment with initialised trackers."""
    formation = EnvCore(configure({"scenario": SCENARIO, "proximity": proximity}))
    formation.seed(0, np.random.default_rng(0))
    formation.begin([0])
    speed, steering = np.full((1, 3), 0.5), np.full((1, 3), 0.2)
    for _ in range(SETTLE):
        formation.step(speed, steering)
    return formation


def _decision(formation: EnvCore, driver: Driver) -> Callable[[], F32]:
    """Return a function that writes all observations and computes the action of one car."""
    out = np.zeros_like(formation.observations)
    observe = formation.parts.mode.bind(formation.loop.view, out)

    def decide() -> F32:
        observe()
        return driver.act(out[0, 0])

    return decide


def _turn(call: Callable[[], Any], n: int) -> Callable[[], float]:
    """Return a function that measures the mean time of `n` calls [us]."""

    def turn() -> float:
        began = time.perf_counter()
        for _ in range(n):
            call()
        return 1e6 * (time.perf_counter() - began) / n

    return turn


def _same(ours: Driver, theirs: Driver, observations: F32) -> None:
    """Check that both drivers return the same actions."""
    difference = float(np.abs(ours.act(observations) - theirs.act(observations)).max())
    if not difference <= SAME:
        raise AssertionError(f"the policy and its peer differ by {difference:g}")


def _row(case: str, value: float, peer_value: float) -> Row:
    return {
        "bench": "policy",
        "case": case,
        "value": value,
        "unit": "us",
        "peer": f"numpy {np.__version__}",
        "peer_value": peer_value,
        "ratio": peer_value / value,
        "hidden": list(HIDDEN),
    }
