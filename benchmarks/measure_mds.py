"""Comparison of `joint` with multidimensional scaling (MDS) of each instant, on recordings.

MDS computes the layout of an instant only from the newest range of each pair. Both are scored after
the best rotation and reflection of each instant, which ranges do not determine. Run `python
benchmarks/measure_mds.py`, which writes benchmarks/results/mds-results.jsonl, then
`benchmarks/make_tables.py`.
"""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from cases import data, recording

from agents.convert import convert
from agents.evaluation.track import track_log
from tracking.arrays import F64
from tracking.estimate import Status, TeamEstimate
from tracking.log import Log
from tracking.maths.mds import classical_mds
from tracking.measurements import Kind
from tracking.metrics.score import Score, score

FILE = Path(__file__).parent / "results" / "mds-results.jsonl"
SKIP = 10.0
"""[s] Time at the start that is not scored."""
NEWEST = 3.0
"""[-] Largest age of a range in median periods of its pair."""
LOGS = ("isas_walk1", "plaza2", "tiers_run01", "tiers_short", "murp_17")
CONVERTED = {"tiers, test1 of case_4": ("tiers_ros2", "tiers"), "murp, trial 03": ("murp", "murp")}
"""Name to the excerpt and its preset for conversion."""


def distances(log: Log, times: F64) -> F64:
    """Return the newest distance of each pair, (time, node, node) [m]; NaN where unknown."""
    n = log.constellation.n_nodes
    block = log.block
    found = np.full((len(times), n, n), np.nan)
    found[:, np.arange(n), np.arange(n)] = 0.0
    for i in range(n):
        for j in range(i + 1, n):
            of_pair = np.minimum(block.i[0], block.j[0]) == i
            of_pair &= np.maximum(block.i[0], block.j[0]) == j
            for kind in (Kind.SURVEY, Kind.RANGE):
                rows = of_pair & (block.kind[0] == kind)
                if rows.sum() < (1 if kind == Kind.SURVEY else 2):
                    continue
                t, metres = block.t[0, rows], block.values[0, rows, 0]
                at = np.searchsorted(t, times, side="right") - 1
                age = times - t[np.maximum(at, 0)]
                still = np.inf if kind == Kind.SURVEY else NEWEST * np.median(np.diff(t))
                good = (at >= 0) & (age <= still)
                found[good, i, j] = found[good, j, i] = metres[at[good]]
    return found


def score_mds(log: Log) -> Score:
    """Score the layout of each instant at which every pair has a distance."""
    group, times = log.constellation, log.truth.times()
    D = distances(log, times)  # noqa: N806
    full = np.isfinite(D).all(axis=(1, 2))
    times, D = times[full], D[full]  # noqa: N806
    estimate = TeamEstimate.empty(group, times)
    for k, of_instant in enumerate(D):
        pos = classical_mds(of_instant, group.dimensions)
        estimate.pos_ij_w[k] = pos[group.pairs[:, 1]] - pos[group.pairs[:, 0]]
    estimate.status[:] = Status.AMBIGUOUS
    truth, has_truth = log.truth.pairs(group, times)
    return score(estimate, truth, has_truth, SKIP)


def line(name: str, log: Log) -> dict[str, Any]:
    """Return the errors of both methods on one recording."""
    mds, joint = score_mds(log), track_log(log, skip=SKIP, findings=()).score
    return {
        "case": name,
        "nodes": log.constellation.n_nodes,
        "instants": mds.n_scored // max(1, log.constellation.n_pairs),
        "mds": mds.rmse_mirror and float(f"{mds.rmse_mirror:.3g}"),
        "joint": joint.rmse_mirror and float(f"{joint.rmse_mirror:.3g}"),
    }


if __name__ == "__main__":
    warnings.simplefilter("error")
    logs = {name: recording(name) for name in LOGS}
    for name, (folder, preset) in CONVERTED.items():
        logs[name] = convert(data() / "raw" / folder, preset=preset).log
    lines = [line(name, log) for name, log in logs.items()]
    FILE.write_text("".join(json.dumps(each) + "\n" for each in lines))
    print(FILE.read_text(), end="")
