"""Ablation of the joint filter: each mechanism is disabled on the same runs.

For `docs/benchmarks/tracker.md`. A mechanism is left out by parameters alone. Errors are paired
with those of the whole filter on the same seeds: the median ratio and its 95 % interval by the
bootstrap.

The runs are those of `cases`. Run `python benchmarks/measure_ablation.py [RUNS] [MECHANISM ...] >
benchmarks/results/ablation.jsonl`, then `python benchmarks/make_tables.py`.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from multiprocessing import Pool
from typing import Any

import numpy as np
from cases import FIRST, RECORDINGS, WORLDS, Case, case, data

from tracking import Tracker, TrackerParams
from tracking.arrays import F64
from tracking.filters.joint.params import JointParams
from tracking.geometry import quat_from_yaw, rotate
from tracking.metrics.score import score

NEVER, ALWAYS = 1e9, 1e-9
SKIP, WRONG = 10.0, 0.5
"""[s], [m] Time at the start that is not scored; position error above which a pair is wrong."""


def joint(change: Callable[[JointParams], JointParams]) -> Callable[[TrackerParams], TrackerParams]:
    """Return a function that changes parameters of the joint filter."""
    return lambda p: replace(p, filter=replace(p.filter, joint=change(p.filter.joint)))


def part(name: str, **values: Any) -> Callable[[TrackerParams], TrackerParams]:
    """Return a function that changes parameters of a part of the joint filter."""
    return joint(lambda p: replace(p, **{name: replace(getattr(p, name), **values)}))


def vehicles(**values: Any) -> Callable[[TrackerParams], TrackerParams]:
    """Return a function that changes parameters of all vehicles."""
    return joint(
        lambda p: replace(p, vehicles={k: replace(v, **values) for k, v in p.vehicles.items()})
    )


def nlos(**values: Any) -> Callable[[TrackerParams], TrackerParams]:
    """Return a function that changes NLOS parameters, in the plane and in space."""
    return joint(
        lambda p: replace(
            p, nlos=replace(p.nlos, **values), nlos_in_space=replace(p.nlos_in_space, **values)
        )
    )


def sanity(**values: Any) -> Callable[[TrackerParams], TrackerParams]:
    """Parameters with some of the checks of IMU samples changed."""
    return lambda p: replace(
        p, orientation=replace(p.orientation, sanity=replace(p.orientation.sanity, **values))
    )


MECHANISMS: dict[str, Callable[[TrackerParams], TrackerParams]] = {
    "states of range errors": part("range_error", max_pairs=ALWAYS),
    "fast range error": part("range_error", fast_std=0.0),
    "second order": part("range_error", nonlinearity_gain=0.0),
    "NLOS": nlos(los_to_nlos_rate=ALWAYS, los_to_nlos_rate_with_power=ALWAYS),
    "large NLOS": nlos(nlos_large_share=0.0),
    "power of ranges": nlos(power_diff_weight=ALWAYS),
    "learned noise": part("noise_learning", learns=False),
    "contradicting pairs count less": part("update", contradiction_share=NEVER),
    "non-holonomic constraint": vehicles(sideways_std=None),
    "states of mounts": vehicles(ahead_std=0.0, slip_std=0.0),
    "level vehicles": vehicles(levelled=False),
    "impacts": vehicles(impact_threshold=None),
    "mean velocity": vehicles(speed_std=NEVER),
    "zero velocity": vehicles(rests=False),
    "motion that looks like rest": part("update", glide_nis=NEVER),
    "bias of accelerations": vehicles(bias_std=ALWAYS, vertical_bias_std=ALWAYS),
    "offset of accelerometers": vehicles(offset_std=None),
    "residual bias of gyroscopes": vehicles(gyro_std=ALWAYS, gyro_drift=ALWAYS),
    "initial tilt": vehicles(initial_tilt_speed=0.0),
    "settling orientations": lambda p: replace(
        p, orientation=replace(p.orientation, settling=ALWAYS)
    ),
    "heading error": vehicles(heading_std=ALWAYS, first_heading_std=None),
    "heading error at first": vehicles(first_heading_std=None),
    "null space of rotations": part("update", follow_share=NEVER, follow_false=NEVER),
    "null space at every range": part("alignment", gauge_std=NEVER),
    "modes apart": part("alignment", mode_std=0.15),
    "static start": part("alignment", settling=ALWAYS, orienting=ALWAYS),
    "delay of wheel likelihoods": part("alignment", wheels_after=ALWAYS),
    "two sides of a newcomer": part("start", join_spread=ALWAYS),
    "split rotations": part("alignment", split_std=NEVER),
    "reflections of degenerate layouts": part("alignment", degenerate=ALWAYS),
    "merging": part("start", merge_distance=ALWAYS),
    "fault: bias": joint(lambda p: replace(p, node_bias_limit=NEVER)),
    "fault: outliers": part("supervision", outlier_ratio=2.0),
    "fault: position": part("supervision", position_misfit=NEVER),
    "fault: alignment": part("start", respawn_nis=NEVER),
    "group outliers": part("supervision", group_outlier_ratio=2.0),
    "nodes without an IMU": joint(lambda p: replace(p, blind_after=NEVER)),
    "frozen ranges": part("supervision", frozen_ranges=NEVER),
    "IMU: stuck": sanity(stuck_after=NEVER),
    "IMU: spikes": sanity(gyr_jump=NEVER, acc_jump=NEVER),
    "IMU: saturation": sanity(chance=1e-300, held_long=NEVER),
    "stale nodes": joint(lambda p: replace(p, range_timeout=NEVER)),
}
"""Mechanism to the change of parameters that disables it."""


def figures(of: Case, params: TrackerParams) -> tuple[float, float, float, float]:
    """Return rmse_yaw [m], rmse_shape [m], and the shares that are ok and wrong, and ok [-]."""
    estimate = Tracker(of.constellation, params).run(of.block, of.t).take(0)
    found = score(estimate, of.truth, of.known, of.t[0] + SKIP)
    turned = rotate(quat_from_yaw(-np.radians(found.yaw_deg or 0.0)), of.truth)
    away = np.linalg.norm(estimate.pos_ij_w - turned, axis=-1)
    ok, n = estimate.ok & of.known, max(of.known.sum(), 1)
    wrong = float((ok & (away > WRONG)).sum() / n)
    return found.rmse_yaw or np.inf, found.rmse_shape or np.inf, wrong, float(ok.sum() / n)


def run(job: tuple[str, int, list[str]]) -> tuple[str, list[tuple[float, float, float, float]]]:
    """Return the metrics of one run: of the complete filter, then without each mechanism."""
    kind, seed, names = job
    of, whole = case(kind, seed), TrackerParams()
    case.cache_clear()
    return kind, [figures(of, whole), *(figures(of, MECHANISMS[name](whole)) for name in names)]


def interval(ratio: F64, rng: np.random.Generator) -> list[float]:
    """Return the median of ratios and its 95 % interval."""
    draws = np.median(rng.choice(ratio, (2000, len(ratio))), axis=1)
    return [float(x) for x in (np.median(ratio), *np.quantile(draws, [0.025, 0.975]))]


def rows(n_runs: int, names: list[str]) -> Iterator[dict[str, Any]]:
    """Yield one row per mechanism and kind of run."""
    kinds = ["cars-los", "cars-nlos", "human", "drones", "hand"]
    kinds += [f"late {kind}" for kind in ("cars-nlos", "robots", "human", "drones", "hand")]
    kinds += ["convoy car", "convoy robot", "exact robot", "exact hand", "exact drone"]
    kinds += ["gliding robot", "gliding human"]
    kinds += [f"world {kind}" for kind in WORLDS]
    faults = ("offset", "outliers", "made up", "silent", "frozen")
    faults += ("dead IMU", "stuck IMU", "IMU spikes", "cut off")
    kinds += [f"{kind}, {fault}" for kind in ("cars-nlos", "drones") for fault in faults]
    jobs = [(kind, FIRST + k, names) for kind in kinds for k in range(n_runs)]
    jobs += [(kind, 0, names) for kind in RECORDINGS if (data() / "logs" / kind).is_dir()]
    found: dict[str, list[Any]] = {}
    with Pool() as pool:
        for done, (kind, figures_of_run) in enumerate(pool.imap(run, jobs), start=1):
            found.setdefault(kind, []).append(figures_of_run)
            print(f"{done} of {len(jobs)} runs", file=sys.stderr, end="\r")
    rng = np.random.default_rng(0)
    for kind, runs in found.items():
        whole, *left_out = np.array(runs).swapaxes(0, 1)
        yield {
            "kind": kind, "without": "", "runs": len(whole), "yaw": float(np.median(whole[:, 0])),
            "shape": float(np.median(whole[:, 1])), "wrong": float(whole[:, 2].mean()),
            "ok": float(whole[:, 3].mean()),
        }  # fmt: skip
        for name, left in zip(names, left_out, strict=True):
            yield {
                "kind": kind,
                "without": name,
                "runs": len(whole),
                "changed": int((left != whole).any(axis=1).sum()),
                "yaw": interval(left[:, 0] / whole[:, 0], rng),
                "shape": interval(left[:, 1] / whole[:, 1], rng),
                "wrong": float(left[:, 2].mean()),
                "ok": float(left[:, 3].mean()),
            }


def main() -> None:
    """Print the rows as JSON lines."""
    n_runs = int(sys.argv[1]) if len(sys.argv) > 1 else 30
    for row in rows(n_runs, sys.argv[2:] or list(MECHANISMS)):
        print(json.dumps(row), flush=True)


if __name__ == "__main__":
    main()
