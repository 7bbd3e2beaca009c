"""Time until all pairs are `ok`, next to the time that an efficient estimator needs.

For `docs/benchmarks/tracker.md`. The information is sufficient when the posterior Cramer-Rao bound
of every pair, with an unknown initial rotation of the group, is below the accuracy that `ok`
promises. The tracker runs with its default parameters, and once more with those that match the
simulation: the difference is what it does not know of noise and obstacles. All times are from the
first range on; before it nodes may be at rest.

Run `python benchmarks/measure_time_to_ok.py [RUNS]`; writes `benchmarks/results/time-to-ok.jsonl`.
"""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from agents.simulation.simulate import simulate
from relpos_env.core.oracle_params import matched_params
from relpos_env.scenarios import recordable
from tests.second_world.record import matched, record
from tests.second_world.world import draw
from tracking import Tracker, TrackerParams
from tracking.arrays import F64, Bool
from tracking.filters.joint.params import JointParams
from tracking.log import Log
from tracking.metrics.bound import UNKNOWN_TURN, posterior_bound
from tracking.vehicles import VEHICLES

OUT = Path(__file__).parent / "results" / "time-to-ok.jsonl"
ROOMS = ("cars-los", "cars-nlos", "human")
WORLDS = ("car", "hand", "drone", "human")
"""Vehicles of the second world."""
SECONDS = 40.0
FIRST = 2000
"""First seed; no parameter was chosen on these runs."""


def run(kind: str, seed: int) -> tuple[Log, JointParams]:
    """Return the log of a run and the parameters that match its simulation."""
    if kind in ROOMS:
        log = simulate(scenario=kind, seconds=SECONDS, seed=seed)
        return log, matched_params(recordable(kind))
    world = draw(seed, kind=kind.removeprefix("second world, "), seconds=SECONDS)
    return record(world), matched(world)


def times(kind: str, seed: int) -> tuple[float, float, float]:
    """Return times [s]; inf if never.

    The time needed by an efficient estimator, and those until all pairs are ok: of the default
    tracker, and of one with the parameters that match the simulation.
    """
    log, params = run(kind, seed)
    constellation = log.constellation
    vehicle = constellation.nodes[0].vehicle
    turn = UNKNOWN_TURN[constellation.dimensions]
    bound = posterior_bound(log, params, skip=0.0, turn_std=turn)
    enough = (bound.pair_rms < VEHICLES[vehicle].accuracy).all(axis=1)
    default = TrackerParams()
    informed = replace(default, filter=replace(default.filter, joint=params))
    first = [_first(bound.t, enough)]
    for given in (default, informed):
        estimate = Tracker(constellation, given).run(log.block, bound.t).take(0)
        first.append(_first(bound.t, estimate.ok.all(axis=1)))
    return first[0], first[1], first[2]


def _first(t: F64, holds: Bool) -> float:
    """Return the time from the start until a condition holds [s]; inf if it never does."""
    return float(t[holds][0] - t[0] + 1e-9) if holds.any() else np.inf


def main() -> None:
    """Measure all kinds and write the results."""
    n, lines = int([*sys.argv[1:], 30][0]), []
    for kind in (*ROOMS, *(f"second world, {vehicle}" for vehicle in WORLDS)):
        found = [times(kind, seed) for seed in range(FIRST, FIRST + n)]
        needed, ok, informed = np.array(found).T
        known = np.isfinite(needed)
        late = np.maximum(2.0 * needed[known], 1.0)
        lines.append(
            {
                "kind": kind,
                "runs": n,
                "sufficient": int(known.sum()),
                "needed_s": float(np.median(needed[known])),
                "ok_s": float(np.median(ok[known])),
                "within_twice": float((ok[known] <= late).mean()),
                "never": int(np.isinf(ok[known]).sum()),
                "matched_s": float(np.median(informed[known])),
                "matched_within_twice": float((informed[known] <= late).mean()),
            }
        )
        print(json.dumps(lines[-1]), flush=True)
    OUT.write_text("".join(json.dumps(line) + "\n" for line in lines), encoding="utf-8")


if __name__ == "__main__":
    main()
