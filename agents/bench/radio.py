"""Benchmark of message-level ranging rounds in a batch of environments, on one core."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from relpos_env.sensors.radio.air import Air
from relpos_env.sensors.radio.params import RadioSimParams
from relpos_env.sensors.radio.radio import Radio
from tracking.arrays import F64
from tracking.ranging.frames.airtime import PAPER_PHY, round_rate
from tracking.ranging.params import SessionParams

DT = 0.01
REPEATS = 5
"""[-] Number of timed runs, of which the fastest counts."""
LONG_FRAMES = RadioSimParams(session=SessionParams(phy=replace(PAPER_PHY, max_frame=1023)))


def bench_radio(*, progress: Callable[[float], None] | None = None) -> list[dict[str, Any]]:
    """Measure the time per round [us] of moving nodes among four obstacles, all pairs ranged.

    The peer is the reference implementation of the radio, with session objects and real bytes.
    """
    cases = ((3, 256), (6, 128), (10, 64), (20, 16), (50, 4))
    rows = []
    for k, (n, envs) in enumerate(cases):
        cost, resolved = radio_cost(n, envs)
        reference = _reference_cost(n)
        rows.append(
            {
                "bench": "radio",
                "case": f"{n} nodes, 4 obstacles, {envs} environments",
                "value": cost,
                "unit": "us/round",
                "peer": "reference session and air",
                "peer_value": reference,
                "ratio": reference / cost,
                "n": n,
                "whole_share": resolved,
            }
        )
        if progress is not None:
            progress((k + 1) / len(cases))
    return rows


def radio_cost(n: int, envs: int) -> tuple[float, float]:
    """Return the time per round at the airtime-limited rate [us], and the resolved range share."""
    rng = np.random.default_rng(n)
    radio = Radio(LONG_FRAMES, n, [int(s) for s in rng.integers(1 << 62, size=envs)], DT)
    for e in range(envs):
        for k in range(n):
            radio.switch_on(e, k, boot=int(rng.integers(256)), after=float(rng.uniform(0, DT)))
    motion, boxes = _motion(n, envs, rng), np.broadcast_to(_boxes(), (envs, 4, 6)).copy()
    hz = round_rate(LONG_FRAMES.session.phy, n)
    settle, windows = round((1.0 + 60.0 / hz) / DT), round(max(0.5, 10.0 / hz) / DT)
    best, ranges, w = np.inf, 0, 0
    for repeat in range(-1, REPEATS):
        spent, count = 0.0, 0
        for _ in range(settle if repeat < 0 else windows):
            before, after = motion(w * DT), motion((w + 1) * DT)
            began = time.perf_counter()
            ranged = radio.step(before, after, boxes)
            spent += time.perf_counter() - began
            count += int(ranged.count.sum())
            w += 1
        if repeat >= 0:
            best, ranges = min(best, spent), ranges + count
    rounds = windows * DT * hz * envs
    return 1e6 * float(best) / rounds, ranges / (REPEATS * rounds * n * (n - 1) / 2)


def _reference_cost(n: int) -> float:
    """Return the time per round of the reference implementation in one environment [us]."""
    rng = np.random.default_rng(n)
    air, motion = Air(LONG_FRAMES, n, 1, DT), _motion(n, 1, rng)
    for k in range(n):
        air.switch_on(k, boot=int(rng.integers(256)), at=float(rng.uniform(0, DT)))
    hz = round_rate(LONG_FRAMES.session.phy, n)
    settle, windows = round((0.3 + 3.0 / hz) / DT), round(max(0.2, 3.0 / hz) / DT)
    spent = 0.0
    for w in range(settle + windows):
        before, after = motion(w * DT)[0], motion((w + 1) * DT)[0]
        began = time.perf_counter()
        air.step(before, after, _boxes())
        spent += time.perf_counter() - began if w >= settle else 0.0
        air.events.clear()
    return 1e6 * spent / (windows * DT * hz)


def _motion(n: int, envs: int, rng: np.random.Generator) -> Callable[[float], F64]:
    """Return a function of time for node positions on ellipses at ~1.2 m/s, (env, node, 3) [m]."""
    phase = rng.uniform(0.0, 2.0 * np.pi, (envs, n))
    size = rng.uniform(0.8, 1.2, (envs, n))

    def at(t: float) -> F64:
        angle = phase + 0.8 * t
        return np.stack(
            [1.2 * size * np.cos(angle), 1.8 * size * np.sin(angle), 0.0 * angle], axis=-1
        )

    return at


def _boxes() -> F64:
    """Return four boxes of half a metre, (4, 6)."""
    centres = np.array([[0.0, 0.0], [0.6, 0.9], [-0.6, 0.9], [0.0, -1.0]])
    return np.column_stack([centres, np.full((4, 2), 0.25), np.ones(4), np.zeros(4)])
