"""The default filter in the second world (`tests/second_world`), an independent simulator.

For `docs/benchmarks/tracker.md`: worlds are drawn at random and tracked: cars with the mounts of
their trackers given, unknown, and labelled robots; hands, drones and bodies in space. The bound
of each world is that of an efficient estimator that knows the world's noise and the mounts.

Run `python benchmarks/measure_second_world.py [WORLDS] [FIRST]` from the top folder; writes
`benchmarks/results/second-world.jsonl`.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from agents.evaluation.track import track_log
from tests.second_world.record import matched, record
from tests.second_world.world import draw
from tracking.metrics.bound import posterior_bound
from tracking.vehicles import VEHICLES

OUT = Path(__file__).parent / "results" / "second-world.jsonl"
KINDS: dict[str, tuple[str, dict[str, Any]]] = {
    "cars, mounts given": ("car", {"is_known": True}),
    "cars, mounts unknown": ("car", {}),
    "cars, labelled robots": ("car", {"vehicle": "robot"}),
    "hands": ("hand", {}),
    "drones": ("drone", {}),
    "bodies": ("human", {}),
}


def figures(seed: int, carrier: str, how: dict[str, Any]) -> list[float]:
    """Return errors and bounds [m], NEES, and shares ok, ok and wrong, ok and within accuracy."""
    world = draw(seed, kind=carrier)
    log = record(world, **how)
    result, bound = track_log(log, findings=[]), posterior_bound(log, matched(world))
    s, has = result.score, result.has_truth
    off = np.linalg.norm((result.estimate.pos_ij_w - result.truth_ij_w), axis=-1)
    ok = result.estimate.ok & has
    promised = VEHICLES[how.get("vehicle", carrier)].accuracy
    within = float(np.mean(off[ok] < promised)) if ok.any() else np.nan
    shares = s.ok_share or 0.0, s.integrity_share or 0.0, within
    errors = s.rmse_yaw or np.inf, s.rmse_shape or np.inf
    return [*errors, bound.rmse_yaw, bound.rmse_shape, s.nees or np.nan, *shares]


def main() -> None:
    """Measure all kinds and write the results."""
    given = [int(x) for x in sys.argv[1:]]
    n, first = [*given, *(100, 1000)[len(given) :]][:2]
    lines = []
    for kind, (carrier, how) in KINDS.items():
        rows = np.array([figures(seed, carrier, how) for seed in range(first, first + n)])
        yaw, shape = rows[:, 0] / rows[:, 2], rows[:, 1] / rows[:, 3]
        lines.append(
            {
                "kind": kind,
                "worlds": n,
                "first": first,
                **dict(zip(("yaw", "shape"), np.median(rows[:, :2], axis=0).tolist(), strict=True)),
                "yaw_ratio": float(np.median(yaw)),
                "shape_ratio": float(np.median(shape)),
                "nees": float(np.nanmedian(rows[:, 4])),
                "ok": float(rows[:, 5].mean()),
                "wrong": float(rows[:, 6].mean()),
                "within": float(np.nanmean(rows[:, 7])),
            }
        )
        print(json.dumps(lines[-1]), flush=True)
    OUT.write_text("".join(json.dumps(line) + "\n" for line in lines), encoding="utf-8")


if __name__ == "__main__":
    main()
