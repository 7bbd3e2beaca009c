"""Simulated and recorded runs for several benchmarks.

Faults affect one node from 25 s on. In "late" runs the tracker starts while all nodes move;
"robots" are late cars without wheel constraints in the filter. "Exact" groups also start in motion:
five nodes in space with exact measurements, or three in the plane with 5 cm of range noise.
Vehicles in a "convoy" follow each other (`tests/convoy.py`).
Recordings are read from `RELPOS_DATA`, else `../shared/data`.
"""

from __future__ import annotations

import os
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import space_runs

sys.path.insert(0, str(Path(__file__).parents[1]))

from agents.simulation.simulate import simulate
from tests.convoy import Convoy
from tests.exact_motion import ExactGroup, Gliders
from tests.second_world.record import record
from tests.second_world.world import draw
from tracking.arrays import F64
from tracking.constellation import Constellation
from tracking.log import read_log
from tracking.measurements import Kind

FIRST = 7000
"""Seed of the first run; it is seed 0 of the second world. No parameter was tuned on these runs."""
RECORDINGS = ("isas_walk1", "inrol_env1")
FAULT_AT = 25.0
"""[s] Start of the faults."""
LATE = 12.0
"""[s] Earliest start of the tracker in late runs; it varies by up to six seconds."""
WORLDS = {"car": "car", "hand": "hand", "drone": "drone", "body": "human"}
"""Kind of run to the vehicle in the second world."""


class Case:
    """Measurements with ground truth."""

    def __init__(
        self, constellation: Any, block: Any, t: F64, truth: F64, known: Any, heading: Any = None
    ) -> None:
        self.constellation, self.block, self.t = constellation, block, t
        self.truth, self.known, self.heading = truth, known, heading


def spoiled(block: Any, fault: str, seed: int) -> Any:
    """Return measurements with one faulty node from `FAULT_AT` on.

    ``offset``: its ranges are 0.6 m too long, as by a wrong calibration. ``outliers``: half of them
    mean nothing, ``made up``: all of them. ``silent``: nothing of it for 3 s. ``frozen``: a pair of
    it repeats a range, 10 s. ``dead IMU``: it has no samples any more. ``stuck
    IMU``: it repeats one reading, 5 s. ``IMU spikes``: one of 100 readings is random, +-30 rad/s
    and +-500 m/s2. ``cut off``: its accelerometer reads 3 m/s2 at most along x and y.
    """
    rng, node = np.random.default_rng(seed), 0
    block = replace(block, values=block.values.copy())  # the run without the fault is cached
    t, ranges = block.t[0], block.kind[0] == Kind.RANGE
    of_node = (block.i[0] == node) | (ranges & (block.j[0] == node))
    late = t > FAULT_AT
    hit = np.flatnonzero(of_node & ranges & late)
    if fault == "dead IMU":
        own = np.isin(block.kind[0], (Kind.IMU, Kind.MAG)) & (block.i[0] == node)
        return block.take(~(own & late))
    if fault == "offset":
        block.values[0, hit, 0] += 0.6
    elif fault in ("outliers", "made up"):
        hit = hit[rng.random(len(hit)) < (0.5 if fault == "outliers" else 1.0)]
        block.values[0, hit, 0] = rng.uniform(0.2, 20.0, len(hit))
    elif fault == "silent":
        return block.take(~(of_node & late & (t < FAULT_AT + 3.0)))
    elif fault == "frozen":
        other = block.j[0] + block.i[0] - node
        hit = hit[(other[hit] == other[hit[0]]) & (t[hit] < FAULT_AT + 10.0)]
        block.values[0, hit, 0] = block.values[0, hit[0], 0]
    else:
        spoil_imu(block, fault, np.flatnonzero((block.kind[0] == Kind.IMU) & of_node & late), rng)
    return block


def spoil_imu(block: Any, fault: str, hit: Any, rng: np.random.Generator) -> None:
    """Spoil these IMU samples of a block in place."""
    if fault == "stuck IMU":
        block.values[0, hit[block.t[0, hit] < FAULT_AT + 5.0], :6] = block.values[0, hit[0], :6]
    elif fault == "IMU spikes":
        hit = hit[rng.random(len(hit)) < 0.01]
        span = np.repeat([30.0, 500.0], 3)
        block.values[0, hit, :6] = span * rng.uniform(-1.0, 1.0, (len(hit), 6))
    elif fault == "cut off":
        block.values[0, hit, 3:5] = np.clip(block.values[0, hit, 3:5], -3.0, 3.0)
    else:
        raise ValueError(f"fault: unknown {fault!r}")


@cache
def case(kind: str, seed: int) -> Case:
    """Return one run, cached.

    Args:
        kind: Kind of run: a scenario, ``hand``, ``drones``, the name of a recording, ``world
            KIND``, ``exact VEHICLE``, ``gliding VEHICLE``, ``convoy VEHICLE``; ``KIND, FAULT`` adds
            a fault, ``late KIND`` starts in motion.
        seed: Seed of the run.
    """
    first, _, rest = kind.partition(" ")
    kind, _, fault = kind.partition(", ")
    if fault:
        good = case(kind, seed)
        block = spoiled(good.block, fault, seed)
        return Case(good.constellation, block, good.t, good.truth, good.known)
    if first == "late":
        return late(case("cars-nlos" if rest == "robots" else rest, seed), seed, rest == "robots")
    if first == "exact":
        return exact(rest, seed)
    if first == "gliding":
        return of_group(noisy(Gliders(rest, range(3), seconds=22.0), seed), 22.0)
    if first == "convoy":
        return of_group(Convoy(rest, 3 + seed % 2, seed), 60.0)
    if kind in ("hand", "drones"):
        run = getattr(space_runs, kind)(seed)
        t = np.arange(0.5, space_runs.SECONDS - 0.1, 0.1)
        pairs, where = run.constellation.pairs, run.positions(t)
        truth = where[:, pairs[:, 1]] - where[:, pairs[:, 0]]
        known = np.ones(truth.shape[:2], dtype=bool)
        return Case(run.constellation, run.block, t, truth, known, run.heading)
    if first == "world":
        log = record(draw(seed - FIRST, kind=WORLDS[rest]))
    elif kind in RECORDINGS:
        log = recording(kind)
    else:
        log = simulate(scenario=kind, seconds=60.0, seed=seed)
    start, last = log.block.t[log.block.valid].min(), log.block.t[log.block.valid].max()
    t = np.arange(start + 0.5, last, 0.1)
    truth, known = log.truth.pairs(log.constellation, t)
    return Case(log.constellation, log.block, t, truth, known)


def exact(vehicle: str, seed: int) -> Case:
    """Return a group of nodes on circles, with random numbering and sample rate."""
    rng = np.random.default_rng(seed)
    n, d, seconds = (3, 2, 25.0) if vehicle == "robot" else (5, 3, 20.0)
    hz = float(rng.uniform(28.0, 125.0))
    group = ExactGroup(vehicle, list(rng.permutation(n)), hz=hz, dimensions=d, seconds=seconds)
    return of_group(noisy(group, seed) if vehicle == "robot" else group, seconds)


def noisy(group: ExactGroup, seed: int) -> ExactGroup:
    """Add 5 cm of noise to the ranges of a group; returns it."""
    ranges = group.block.kind[0] == Kind.RANGE
    noise = np.random.default_rng(seed).standard_normal(ranges.sum())
    group.block.values[0, ranges, 0] += 0.05 * noise
    return group


def of_group(group: ExactGroup, seconds: float) -> Case:
    """Return the case of a group of the tests."""
    t = np.arange(0.2, seconds - 0.5, 0.1)
    truth = group.pairs(t)
    return Case(group.constellation, group.block, t, truth, np.ones(truth.shape[:2], dtype=bool))


def late(of: Case, seed: int, are_robots: bool) -> Case:
    """Return a run with a tracker that starts in motion, without wheel constraints if robots."""
    at, kind = of.t[0] + LATE + seed % 7, of.block.kind[0]
    block = of.block.take((of.block.t[0] >= at) | (kind == Kind.SURVEY))
    # Surveyed distances are valid from the start on.
    block = replace(block, t=np.where(block.kind == Kind.SURVEY, at, block.t))
    who, times = of.constellation, of.t >= at
    if are_robots:
        nodes = tuple(replace(node, vehicle="robot") for node in who.nodes)
        who = Constellation(nodes=nodes, dimensions=who.dimensions)
    block = block.take(block.order()[0])
    return Case(who, block, of.t[times], of.truth[times], of.known[times])


def recording(name: str) -> Any:
    """Read a recorded log."""
    return read_log(data() / "logs" / name)


def data() -> Path:
    """Return the folder of the recordings."""
    default = Path(__file__).resolve().parents[2] / "shared" / "data"
    return Path(os.environ.get("RELPOS_DATA", default))
