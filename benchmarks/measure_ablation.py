"""What each mechanism of the joint filter is worth: each left out on the same runs.

For `docs/explanation/tracker.md`. A mechanism is left out by parameters alone. Errors are paired
with those of the whole filter on the same seeds: the median ratio and its 95 % interval by the
bootstrap.

Faults are those of one node from 25 s on. Recordings are read from `RELPOS_DATA`, else
`../shared/data`. Run `python benchmarks/measure_ablation.py [RUNS] [MECHANISM ...] > rows.jsonl`,
then `python benchmarks/measure_ablation.py --table rows.jsonl`.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import space_runs

from agents.simulation.simulate import simulate
from tracking import Tracker, TrackerParams
from tracking.arrays import F64
from tracking.filters.joint.params import JointParams
from tracking.filters.params import FilterParams
from tracking.geometry import quat_from_yaw, rotate
from tracking.log import read_log
from tracking.measurements import Kind
from tracking.metrics.score import score

NEVER, ALWAYS = 1e9, 1e-9
FIRST = 7000
"""Seed of the first run; no parameter was chosen on it or those after it."""
SKIP, WRONG = 10.0, 0.5
"""[s, m] Not scored; a pair that is off by more is wrong."""
RECORDINGS = ("isas_walk1", "inrol_env1")
FAULT_AT = 25.0
"""[s]"""


def part(name: str, **values: Any) -> Callable[[JointParams], JointParams]:
    """Parameters with some of a part changed."""
    return lambda p: replace(p, **{name: replace(getattr(p, name), **values)})


def vehicles(**values: Any) -> Callable[[JointParams], JointParams]:
    """Parameters with those of every vehicle changed."""
    return lambda p: replace(
        p, vehicles={name: replace(v, **values) for name, v in p.vehicles.items()}
    )


MECHANISMS: dict[str, Callable[[JointParams], JointParams]] = {
    "states of range errors": part("range_error", max_pairs=ALWAYS),
    "NLOS": lambda p: replace(
        p,
        nlos=replace(p.nlos, los_to_nlos_rate=ALWAYS, los_to_nlos_rate_with_power=ALWAYS),
        nlos_in_space=replace(
            p.nlos_in_space, los_to_nlos_rate=ALWAYS, los_to_nlos_rate_with_power=ALWAYS
        ),
    ),
    "non-holonomic constraint": vehicles(sideways_std=None),
    "level vehicles": vehicles(levelled=False),
    "bias of accelerations": vehicles(bias_std=ALWAYS, vertical_bias_std=ALWAYS),
    "heading error": vehicles(heading_std=ALWAYS, first_heading_std=None),
    "offset of accelerometers": vehicles(offset_std=None),
    "node faults: outliers": part("supervision", outlier_ratio=2.0),
    "node faults: offsets": lambda p: replace(p, node_bias_limit=NEVER),
    "wrong positions": part("supervision", position_misfit=NEVER),
    "frozen ranges": part("supervision", frozen_ranges=NEVER),
    "stale nodes": lambda p: replace(p, range_timeout=NEVER),
    "challenge of the alignment": part("start", respawn_nis=NEVER),
    "degenerate layouts": part("alignment", degenerate=ALWAYS),
    "merging": part("start", merge_distance=ALWAYS),
    "observability at every range": part("alignment", gauge_std=NEVER),
    "second order": part("range_error", nonlinearity_gain=0.0),
    "impacts": vehicles(impact_threshold=None),
    "initial tilt": vehicles(initial_tilt_speed=0.0),
    "rest": vehicles(rests=False),
    "heading error at first": vehicles(first_heading_std=None),
    "large NLOS": lambda p: replace(
        p, nlos_in_space=replace(p.nlos_in_space, nlos_large_share=0.0)
    ),
    "power of ranges": lambda p: replace(
        p,
        nlos=replace(p.nlos, power_diff_weight=ALWAYS),
        nlos_in_space=replace(p.nlos_in_space, power_diff_weight=ALWAYS),
    ),
    "fast range error": part("range_error", fast_std=0.0),
    "states of mounts": vehicles(ahead_std=0.0, slip_std=0.0),
    "learned noise": part("noise_learning", learns=False),
    "patience with wheels": part("alignment", wheels_after=ALWAYS),
}
"""Name to parameters without it."""


class Case:
    """Measurements with the truth."""

    def __init__(self, constellation: Any, block: Any, t: F64, truth: F64, known: Any) -> None:
        self.constellation, self.block, self.t = constellation, block, t
        self.truth, self.known = truth, known


def spoiled(block: Any, fault: str, seed: int) -> Any:
    """Measurements with one node at fault from `FAULT_AT` on.

    ``offset``: its ranges are 0.6 m too long, as by a wrong calibration. ``outliers``: half of them
    mean nothing. ``silent``: nothing of it for 3 s. ``frozen``: a pair of it repeats a range, 10 s.
    """
    rng, node = np.random.default_rng(seed), 0
    block = replace(block, values=block.values.copy())  # the run without the fault is kept
    t, ranges = block.t[0], block.kind[0] == Kind.RANGE
    of_node = (block.i[0] == node) | (ranges & (block.j[0] == node))
    late = t > FAULT_AT
    hit = np.flatnonzero(of_node & ranges & late)
    if fault == "offset":
        block.values[0, hit, 0] += 0.6
    elif fault == "outliers":
        hit = hit[rng.random(len(hit)) < 0.5]
        block.values[0, hit, 0] = rng.uniform(0.2, 20.0, len(hit))
    elif fault == "silent":
        return block.take(~(of_node & late & (t < FAULT_AT + 3.0)))
    elif fault == "frozen":
        other = block.j[0] + block.i[0] - node
        hit = hit[(other[hit] == other[hit[0]]) & (t[hit] < FAULT_AT + 10.0)]
        block.values[0, hit, 0] = block.values[0, hit[0], 0]
    return block


@cache
def case(kind: str, seed: int) -> Case:
    """One run, made once; ``KIND, FAULT`` is one with a fault."""
    kind, _, fault = kind.partition(", ")
    if fault:
        good = case(kind, seed)
        block = spoiled(good.block, fault, seed)
        return Case(good.constellation, block, good.t, good.truth, good.known)
    if kind in ("hand", "drones"):
        run = getattr(space_runs, kind)(seed)
        t = np.arange(0.5, space_runs.SECONDS - 0.1, 0.1)
        pairs, where = run.constellation.pairs, run.positions(t)
        truth = where[:, pairs[:, 1]] - where[:, pairs[:, 0]]
        return Case(run.constellation, run.block, t, truth, np.ones(truth.shape[:2], dtype=bool))
    log = (
        recording(kind) if kind in RECORDINGS else simulate(scenario=kind, seconds=60.0, seed=seed)
    )
    first, last = log.block.t[log.block.valid].min(), log.block.t[log.block.valid].max()
    t = np.arange(first + 0.5, last, 0.1)
    truth, known = log.truth.pairs(log.constellation, t)
    return Case(log.constellation, log.block, t, truth, known)


def recording(name: str) -> Any:
    """A recorded log."""
    return read_log(data() / "logs" / name)


def data() -> Path:
    """Where recordings are."""
    default = Path(__file__).resolve().parents[2] / "shared" / "data"
    return Path(os.environ.get("RELPOS_DATA", default))


def figures(of: Case, params: JointParams) -> tuple[float, float, float]:
    """rmse_yaw [m], rmse_shape [m], share of pairs and time that are ok and wrong."""
    tracker = Tracker(of.constellation, TrackerParams(filter=FilterParams(joint=params)))
    estimate = tracker.run(of.block, of.t).take(0)
    found = score(estimate, of.truth, of.known, of.t[0] + SKIP)
    turned = rotate(quat_from_yaw(-np.radians(found.yaw_deg or 0.0)), of.truth)
    away = np.linalg.norm(estimate.pos_ij_w - turned, axis=-1)
    wrong = (estimate.ok & of.known & (away > WRONG)).sum() / max(of.known.sum(), 1)
    return found.rmse_yaw or np.inf, found.rmse_shape or np.inf, float(wrong)


def interval(ratio: F64, rng: np.random.Generator) -> list[float]:
    """Median of ratios and its 95 % interval."""
    draws = np.median(rng.choice(ratio, (2000, len(ratio))), axis=1)
    return [float(x) for x in (np.median(ratio), *np.quantile(draws, [0.025, 0.975]))]


def rows(n_runs: int, names: list[str]) -> Iterator[dict[str, Any]]:
    """A row for each mechanism and kind of run."""
    kinds = {k: n_runs for k in ("cars-los", "cars-nlos", "human", "drones", "hand")}
    faults = ("offset", "outliers", "silent", "frozen")
    kinds |= {f"{k}, {f}": n_runs for k in ("cars-nlos", "drones") for f in faults}
    kinds |= {k: 1 for k in RECORDINGS if (data() / "logs" / k).is_dir()}
    default, rng = JointParams(), np.random.default_rng(0)
    for kind, n in kinds.items():
        cases = [case(kind, FIRST + k) for k in range(n)]
        whole = np.array([figures(c, default) for c in cases])
        yield {
            "kind": kind, "without": "", "runs": n, "yaw": float(np.median(whole[:, 0])),
            "shape": float(np.median(whole[:, 1])), "wrong": float(whole[:, 2].mean()),
        }  # fmt: skip
        for name in names:
            left = np.array([figures(c, MECHANISMS[name](default)) for c in cases])
            yield {
                "kind": kind,
                "without": name,
                "runs": n,
                "changed": int((left != whole).any(axis=1).sum()),
                "yaw": interval(left[:, 0] / whole[:, 0], rng),
                "shape": interval(left[:, 1] / whole[:, 1], rng),
                "wrong": float(left[:, 2].mean()),
            }


def tables(lines: list[str]) -> str:
    """Rows as two tables in Markdown: without a fault, and with one."""
    rows = [json.loads(line) for line in lines]
    kinds = list(dict.fromkeys(row["kind"] for row in rows))
    names = list(dict.fromkeys(row["without"] for row in rows))
    found = {(row["without"], row["kind"]): row for row in rows}
    parts = []
    for some in ([k for k in kinds if "," not in k], [k for k in kinds if "," in k]):
        head = ["without", *some]
        text = [head, ["---"] * len(head)]
        text += [[name or "all of them", *(cell(found[name, k]) for k in some)] for name in names]
        parts.append("\n".join("| " + " | ".join(row) + " |" for row in text))
    return "\n\n".join(parts)


def cell(row: dict[str, Any]) -> str:
    """One figure: errors [m] of the whole filter, else their ratio to it; and what is wrong."""
    wrong = f"{100.0 * row['wrong']:.2g} %"
    if not row["without"]:
        return f"{row['yaw']:.3f} / {row['shape']:.3f} m; {wrong}"
    if not row["changed"]:
        return "="
    (yaw, low, high), (shape, *ends) = row["yaw"], row["shape"]
    if row["runs"] == 1:
        return f"{yaw:.2f} / {shape:.2f}; {wrong}"
    return f"{yaw:.2f} ({low:.2f}-{high:.2f}) / {shape:.2f} ({ends[0]:.2f}-{ends[1]:.2f}); {wrong}"


def main() -> None:
    """Print the rows as JSON lines, or rows of before as tables."""
    if sys.argv[1:2] == ["--table"]:
        print(tables(Path(sys.argv[2]).read_text().splitlines()))
        return
    n_runs = int(sys.argv[1]) if len(sys.argv) > 1 else 40
    for row in rows(n_runs, sys.argv[2:] or list(MECHANISMS)):
        print(json.dumps(row), flush=True)


if __name__ == "__main__":
    main()
