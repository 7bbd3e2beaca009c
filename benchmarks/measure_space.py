"""Accuracy of the tracker in space from raw sensors: hands next to fixed nodes, and drones.

For `docs/benchmarks/tracker.md`; the runs are those of `space_runs.py`. Nothing of them is in a
log, so filters can be compared on hundreds before a recording is looked at.

Run `python benchmarks/measure_space.py hand|drones [RUNS] [FIRST SEED] [FILTER]`.
"""

from __future__ import annotations

import json
import sys
from dataclasses import asdict, dataclass

import numpy as np
from space_runs import SECONDS, Run, drones, hand

from tracking import Tracker, TrackerParams
from tracking.filters import FilterParams
from tracking.filters.joint.params import JointParams
from tracking.geometry import quat_from_yaw, rotate
from tracking.metrics.score import score

SKIP, SETTLED = 10.0, 30.0
"""[s] Time at the start that is not scored; start of the second score."""
WRONG = 0.5
"""[m] Position error after the constant yaw of the run above which a pair is wrong."""
TO_A_METRE = TrackerParams(filter=FilterParams(joint=JointParams(accuracy=1.0)))
"""Accuracy of 1 m for status ok; the expected error of drones is rarely below the default."""


@dataclass(frozen=True, slots=True)
class Judged:
    """Results of one run."""

    seed: int
    rmse_yaw: float
    """[m] Error after one constant yaw, from 10 s on."""
    rmse_shape: float
    """[m] Error after the best rotation at each instant, from 10 s on."""
    settled_yaw: float
    """[m] Error after one constant yaw, from 30 s on."""
    settled_shape: float
    """[m] Error after the best rotation at each instant, from 30 s on."""
    first_ok: float
    """[s] First time when all pairs with a moving node were ok; infinite if never."""
    ok: float
    """[-] Share of pairs and time with status ok."""
    ok_but_wrong: float
    """[-] Share of pairs and time with status ok and a wrong position."""
    nees: float
    """[-] NEES per degree of freedom, from 30 s on."""


def judge(run: Run, seed: int, filter: str = "joint") -> Judged:
    """Track a run and compare it with ground truth."""
    pairs, t = run.constellation.pairs, np.arange(0.5, SECONDS - 0.1, 0.1)
    estimate = Tracker(run.constellation, TO_A_METRE, filter=filter).run(run.block, t).take(0)
    where = run.positions(t)
    truth, known = where[:, pairs[:, 1]] - where[:, pairs[:, 0]], np.ones((len(t), len(pairs)))
    whole = score(estimate, truth, known.astype(bool), SKIP)
    settled = score(estimate, truth, known.astype(bool), SETTLED)
    turned = rotate(quat_from_yaw(-np.radians(whole.yaw_deg or 0.0)), truth)
    moving = ~run.constellation.is_static[pairs].all(axis=1)
    away = np.linalg.norm(estimate.pos_ij_w - turned, axis=-1)[:, moving]
    ok = estimate.ok[:, moving]
    return Judged(
        seed=seed,
        rmse_yaw=whole.rmse_yaw,
        rmse_shape=whole.rmse_shape,
        settled_yaw=settled.rmse_yaw,
        settled_shape=settled.rmse_shape,
        first_ok=float([*t[ok.all(axis=1)], np.inf][0]),
        ok=float(ok.mean()),
        ok_but_wrong=float((ok & (away > WRONG)).mean()),
        nees=settled.nees,
    )


def summary(runs: list[Judged]) -> dict[str, float]:
    """Return medians, means of outlier-sensitive metrics, and the number of runs off by > 1 m."""
    of = {k: np.array([getattr(r, k) for r in runs], dtype=np.float64) for k in Judged.__slots__}
    medians = ("rmse_yaw", "rmse_shape", "settled_yaw", "settled_shape", "first_ok", "nees")
    return (
        {f"{k}_median": float(np.median(of[k])) for k in medians}
        | {f"{k}_mean": float(of[k].mean()) for k in ("settled_yaw", "settled_shape")}
        | {k: float(of[k].mean()) for k in ("ok", "ok_but_wrong")}
        | {"lost": float((of["settled_shape"] > 1.0).sum()), "runs": float(len(runs))}
    )


def main() -> None:
    """Print every run and the summary."""
    given = dict(enumerate(sys.argv[1:]))
    make = {"hand": hand, "drones": drones}[given[0]]
    first = int(given.get(2, 0))
    runs = []
    for seed in range(first, first + int(given.get(1, 80))):
        runs.append(judge(make(seed), seed, given.get(3, "joint")))
        print(json.dumps({k: round(v, 3) for k, v in asdict(runs[-1]).items()}))
    print(json.dumps(summary(runs), indent=1))


if __name__ == "__main__":
    main()
