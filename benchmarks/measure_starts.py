"""Convergence of a tracker that starts in the middle of a recording.

For `docs/benchmarks/tracker.md`: a recording is cut at many places, and the tracker knows
nothing of what was before; for half a minute each it is judged as `relpos track` does, from ten
seconds on.

Run `python benchmarks/measure_starts.py FOLDER [EVERY] [FILTER]`, with a log folder that has ground
truth and the time between two starts [s], 4 by default.
"""

from __future__ import annotations

import json
import sys
from dataclasses import asdict, dataclass

import numpy as np

from tracking import Tracker
from tracking.geometry import quat_from_yaw, rotate
from tracking.log import Log, read_log
from tracking.metrics.score import score

SECONDS, SKIP = 30.0, 10.0
"""[s] Length of a run; time at its start that is not scored."""
WRONG = 0.5
"""[m] Position error after the constant yaw of the run above which a pair is wrong."""


@dataclass(frozen=True, slots=True)
class Begun:
    """Results of one start."""

    at: float
    """[s] Start in the time of the recording."""
    rmse_yaw: float
    """[m] Error after one constant yaw, from 10 to 30 s."""
    rmse_shape: float
    """[m] Error after the best rotation at each instant, from 10 to 30 s."""
    first_ok: float | None
    """[s] Time until all pairs with a moving node were ok; None if never."""
    ok: float
    """[-] Share of pairs and time with status ok."""
    ok_but_wrong: float
    """[-] Share of pairs and time with status ok and a wrong position."""


def begin(log: Log, at: float, filter: str) -> Begun:
    """Track a recording from a time on."""
    constellation, every = log.constellation, log.block.t[0]
    block = log.block.take(slice(*np.searchsorted(every, [at, at + SECONDS]).tolist()))
    t = log.truth.times()
    t = t[(t > at) & (t < at + SECONDS)]
    estimate = Tracker(constellation, filter=filter).run(block, t).take(0)
    truth, has_truth = log.truth.pairs(constellation, t)
    s = score(estimate, truth, has_truth, at + SKIP)
    moving = ~constellation.is_static[constellation.pairs].all(axis=1)
    turned = rotate(quat_from_yaw(-np.radians(s.yaw_deg or 0.0)), truth)
    away = np.linalg.norm(estimate.pos_ij_w - turned, axis=-1)[:, moving]
    ok = estimate.ok[:, moving]
    all_ok = t[ok.all(axis=1)]
    return Begun(
        at=at,
        rmse_yaw=s.rmse_yaw,
        rmse_shape=s.rmse_shape,
        first_ok=float(all_ok[0]) - at if len(all_ok) else None,
        ok=float(ok.mean()),
        ok_but_wrong=float((ok & (away > WRONG)).mean()),
    )


def summary(starts: list[Begun]) -> dict[str, float]:
    """Return medians of the errors and means of the shares."""
    of = {k: np.array([getattr(s, k) for s in starts], dtype=np.float64) for k in Begun.__slots__}
    first = np.nan_to_num(of["first_ok"], nan=np.inf)
    return {
        "starts": len(starts),
        "rmse_yaw_median": float(np.median(of["rmse_yaw"])),
        "rmse_shape_median": float(np.median(of["rmse_shape"])),
        "first_ok_median": float(np.median(first)),
        "ok": float(of["ok"].mean()),
        "ok_but_wrong": float(of["ok_but_wrong"].mean()),
    }


def main() -> None:
    """Print every start and the summary."""
    given = dict(enumerate(sys.argv[1:]))
    log, every = read_log(given[0]), float(given.get(1, 4.0))
    first, last = log.t_range
    starts = [
        begin(log, float(at), given.get(2, "joint"))
        for at in np.arange(first, last - SECONDS, every)
    ]
    for s in starts:
        print(json.dumps({k: v if v is None else round(v, 3) for k, v in asdict(s).items()}))
    print(json.dumps(summary(starts), indent=1))


if __name__ == "__main__":
    main()
