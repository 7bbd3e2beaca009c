"""Convergence of the tracker after a cold start.

Cars are at rest for two seconds and then drive. Three seconds later the error over all pairs is
measured in the world frame, and after the best rotation, which is independent of magnetic north.
Both are compared with the posterior Cramer-Rao bound of the same drive at the same time
(`tracking.metrics.bound`), with the initial heading errors of the simulation
(`relpos_env.core.oracle_params`).

Run `python benchmarks/measure_cold_start.py [SCENARIO] [FIRST SEED] [DRIVES] [JOBS] [FILE]`; some
tenths of a second per drive. Writes one JSON line per drive to the file.
"""

from __future__ import annotations

import json
import sys
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from agents.jobs.local import local
from agents.simulation.simulate import simulate
from relpos_env.core.oracle_params import matched_params
from relpos_env.scenarios import recordable
from relpos_env.timing import STAND_STILL
from tracking import Tracker
from tracking.estimate import Status
from tracking.geometry import best_rotation
from tracking.metrics.bound import posterior_bound

JUDGED = STAND_STILL + 3.0
"""[s] Time of the measurement after the start of the recording."""
SECONDS = 17.0
NEAR, WRONG = 0.15, 1.0
"""[m] Target error; position error above which a pair is wrong."""


@dataclass(frozen=True, slots=True)
class Start:
    """Results of one drive."""

    seed: int
    error: float
    """[m] RMS position error over the pairs, in the world frame."""
    turned: float
    """[m] RMS position error after the best rotation."""
    bound: float
    """[m] Bound of `error`."""
    bound_turned: float
    """[m] Bound of `turned`."""
    first_ok: float | None
    """[s] Time from the first motion until all pairs were ok; None if never."""
    ok_but_wrong: float
    """[s] Longest uninterrupted time in which a pair was ok and wrong."""


def start(scenario: str, seed: int) -> Start:
    """Measure one drive."""
    log = simulate(scenario=scenario, seconds=SECONDS, seed=seed)
    t = log.truth.times()
    t = t[t >= log.t_range[0]]
    estimate = Tracker(log.constellation).run(log.block, t).take(0)
    truth, _ = log.truth.pairs(log.constellation, t)
    flat = np.array([1.0, 1.0, 0.0])
    found, truth = estimate.pos_ij_w * flat, truth * flat
    away = np.linalg.norm(found - truth, axis=-1)
    now = int(np.searchsorted(t, JUDGED))
    turn = best_rotation(found[now : now + 1], truth[now : now + 1], planar=True)[0]
    ok = estimate.ok.all(axis=1) & (t >= STAND_STILL)
    skip = JUDGED - log.t_range[0]
    bound = posterior_bound(log, matched_params(recordable(scenario)), skip=skip)
    known = ~np.isin(estimate.status[now], (Status.ABSENT, Status.STARTING)).any()
    return Start(
        seed=seed,
        error=_rms(found[now] - truth[now]) if known else np.inf,
        turned=_rms(found[now] @ turn.T - truth[now]) if known else np.inf,
        bound=_rms(bound.pair_rms[0][:, None]),
        bound_turned=float(bound.shape_rms[0]),
        first_ok=float(t[ok][0]) - STAND_STILL if ok.any() else None,
        ok_but_wrong=max(_longest(t, wrong) for wrong in (estimate.ok & (away > WRONG)).T),
    )


def _rms(vectors: np.ndarray) -> float:
    return float(np.sqrt((vectors**2).sum(axis=-1).mean()))


def _longest(t: np.ndarray, on: np.ndarray) -> float:
    """Return the longest uninterrupted time in which `on` is true [s]."""
    steps = np.diff(np.concatenate([[0], on.astype(np.int64), [0]]))
    begin, end = t[np.nonzero(steps == 1)[0]], t[np.nonzero(steps == -1)[0] - 1]
    return float((end - begin).max(initial=0.0))


def share_near(bound: np.ndarray, bound_turned: np.ndarray, n_shape: int = 3) -> float:
    """Return the share of drives below `NEAR` for an efficient filter with Gaussian errors.

    Args:
        bound: Bound of each drive in the world frame, (drive,) [m].
        bound_turned: Bound after the best rotation, (drive,) [m]; the rest is the rotation.
        n_shape: Degrees of freedom of the shape, assumed equally uncertain: 3 for 3 cars.
    """
    rng = np.random.default_rng(0)
    draws = 1000, len(bound)
    turn = np.sqrt(np.maximum(bound**2 - bound_turned**2, 0.0)) * rng.standard_normal(draws)
    shape = bound_turned**2 * rng.chisquare(n_shape, draws) / n_shape
    return float((turn**2 + shape < NEAR**2).mean())


def summary(starts: list[Start]) -> dict[str, float]:
    """Return statistics of the drives and of their bounds."""
    of = {k: np.array([getattr(s, k) for s in starts]) for k in ("error", "turned", "bound",
        "bound_turned", "ok_but_wrong")}  # fmt: skip
    first = np.array([np.inf if s.first_ok is None else s.first_ok for s in starts])
    return {
        "drives": len(starts),
        "near": float((of["error"] < NEAR).mean()),
        "turned_near": float((of["turned"] < NEAR).mean()),
        "bound_near": share_near(of["bound"], of["bound_turned"]),
        "bound_turned_near": share_near(of["bound_turned"], of["bound_turned"]),
        "error_rms": float(np.sqrt((np.minimum(of["error"], 1.0) ** 2).mean())),
        "error_median": float(np.median(of["error"])),
        "bound_rms": float(np.sqrt((of["bound"] ** 2).mean())),
        "turned_median": float(np.median(of["turned"])),
        "turned_rms": float(np.sqrt((np.minimum(of["turned"], 1.0) ** 2).mean())),
        "bound_turned_rms": float(np.sqrt((of["bound_turned"] ** 2).mean())),
        "first_ok_median": float(np.median(first)),
        "first_ok_99": float(np.quantile(first, 0.99, method="higher")),
        "ok_but_wrong_over_1s": float((of["ok_but_wrong"] > 1.0).sum()),
    }


def main() -> None:
    """Print the summary."""
    given = dict(enumerate(sys.argv[1:]))
    scenario, first = given.get(0, "cars-nlos"), int(given.get(1, 7000))
    seeds = range(first, first + int(given.get(2, 100)))
    tasks = [(scenario, seed) for seed in seeds]
    starts = [s for _, s in sorted(local(start, tasks, int(given.get(3, 2))))]
    if 4 in given:
        Path(given[4]).write_text("".join(json.dumps(asdict(s)) + "\n" for s in starts))
    print(json.dumps(summary(starts), indent=1))


if __name__ == "__main__":
    main()
