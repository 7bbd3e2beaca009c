"""Consistency of the joint filter.

NEES and NIS of `joint` with the parameters of the simulated world
(`relpos_env.core.oracle_params`), means over drives: 1 is consistent, more is overconfident. With
DEGREES, the magnetometer of one car is rotated by this angle, which the filter does not model.

Run `python benchmarks/measure_consistency.py [SCENARIO] [FIRST SEED] [DRIVES] [JOBS] [DEGREES]`;
some tenths of a second per drive of 40 s.
"""

from __future__ import annotations

import json
import sys

import numpy as np

from agents.jobs.local import local
from agents.simulation.simulate import simulate
from relpos_env.core.oracle_params import matched_params
from relpos_env.scenarios import recordable
from tracking import Tracker, TrackerParams
from tracking.filters import FilterParams
from tracking.measurements import Kind
from tracking.metrics.score import score

SECONDS, SKIP = 40.0, 10.0
"""[s] Length of a drive; time at its start that is not scored."""


def measure(scenario: str, degrees: float, seed: int) -> tuple[float, float]:
    """Return the NEES per degree of freedom and the mean NIS of a drive."""
    log = simulate(scenario=scenario, seconds=SECONDS, seed=seed)
    block = log.block
    if degrees:
        c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
        turned = (block.kind == Kind.MAG) & (block.i == 0)
        x, y = block.values[turned, 0].copy(), block.values[turned, 1].copy()
        block.values[turned, 0], block.values[turned, 1] = c * x - s * y, s * x + c * y
    t = log.truth.times()
    t = t[t >= log.t_range[0]]
    joint = matched_params(recordable(scenario))
    tracker = Tracker(log.constellation, TrackerParams(filter=FilterParams(joint=joint)))
    estimate = tracker.run(block, t).take(0)
    truth, known = log.truth.pairs(log.constellation, t)
    nees = score(estimate, truth, known, SKIP).nees
    return float("nan") if nees is None else nees, float(tracker.mean_nis()[0])


def main() -> None:
    """Print the means, and the drives with the largest NEES."""
    given = dict(enumerate(sys.argv[1:]))
    scenario, first = given.get(0, "cars-los"), int(given.get(1, 7000))
    degrees = float(given.get(4, 0.0))
    seeds = range(first, first + int(given.get(2, 50)))
    tasks = [(scenario, degrees, seed) for seed in seeds]
    nees, nis = np.array([out for _, out in sorted(local(measure, tasks, int(given.get(3, 2))))]).T
    worst = np.argsort(nees)[::-1][:3]
    print(
        json.dumps(
            {
                "drives": len(seeds),
                "nees": float(np.nanmean(nees)),
                "nees_median": float(np.nanmedian(nees)),
                "nis": float(nis.mean()),
                "largest": {seeds[k]: round(float(nees[k]), 2) for k in worst},
            },
            indent=1,
        )
    )


if __name__ == "__main__":
    main()
