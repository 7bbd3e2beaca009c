"""One run: a simulated log is tracked by one filter and scored."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from agents.evaluation.lost import converged_at, lost_at
from agents.evaluation.over_time import OverTime, over_time
from agents.evaluation.suites import Case
from tracking.geometry import quat_from_yaw, rotate
from tracking.log import Log
from tracking.measurements import Kind
from tracking.metrics.bound import Bound, posterior_bound
from tracking.metrics.gospa import labelled_gospa
from tracking.metrics.score import score
from tracking.params.short_repr import short_repr
from tracking.tracker import Tracker

SKIP = 10.0
"""[s] Time after the first range that is not scored."""
WARM_UP = 200
"""[-] Events that are tracked before the time measurement, which excludes compilation."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RunResult:
    """Metrics of one case, seed and filter; None where there was nothing to score."""

    __repr__ = short_repr

    case: str
    scenario: str
    filter: str
    seed: int
    nodes: int
    rmse: float | None
    """[m] Position error without alignment."""
    rmse_yaw: float | None
    """[m] Position error after one constant yaw."""
    rmse_shape: float | None
    """[m] Position error after the best rotation at each instant."""
    bound: float | None
    """[m] Expected `rmse` of an efficient estimator (posterior CRLB, `tracking.metrics.bound`)."""
    bound_yaw: float | None
    """[m] Expected `rmse_yaw` of an efficient estimator."""
    bound_shape: float | None
    """[m] Expected `rmse_shape` of an efficient estimator."""
    nees: float | None
    """[-] Mean NEES of positions after one constant yaw, per dimension."""
    nis: float | None
    """[-] Mean NIS of accepted ranges."""
    gospa: float | None
    """[m] Labelled GOSPA after one constant yaw: errors, missed and false pairs."""
    coverage: float | None
    """[-] Share of the scored time with an estimate."""
    ok_share: float | None
    """[-] Share of the scored time with status ok."""
    integrity_share: float | None
    """[-] Share of the run in which pairs were ok and wrong, see `tracking.metrics.integrity`."""
    integrity_worst_s: float | None
    """[s] Longest uninterrupted time in which a pair was ok and wrong."""
    converged_s: float
    """[s] Time from the first range until all pairs were ok, at most 10."""
    lost_s: float | None
    """[s] Time when the run was lost, None if never."""
    rejected: int
    """Ranges rejected as outliers."""
    rounds_hz: float
    """[1/s] Ranges per pair and second."""
    us_per_round: float
    """[us] Run time of the tracker per ranging round, orientation and reports included; the only
    metric that is not repeatable."""
    over_time: OverTime

    @property
    def lost(self) -> bool:
        """True if the run was lost."""
        return self.lost_s is not None

    @property
    def ratio_bound(self) -> float | None:
        """`rmse_yaw` over its bound [-]."""
        return _ratio(self.rmse_yaw, self.bound_yaw)

    @property
    def ratio_shape(self) -> float | None:
        """`rmse_shape` over its bound [-]."""
        return _ratio(self.rmse_shape, self.bound_shape)

    @property
    def record(self) -> dict[str, Any]:
        """Metrics for JSON."""
        names = [n for n in self.__slots__ if n != "over_time"]
        return {n: getattr(self, n) for n in names} | {
            "ratio_bound": self.ratio_bound,
            "ratio_shape": self.ratio_shape,
        }


def run(case: Case, log: Log, filter: str, seed: int, bound: Bound | None) -> RunResult:
    """Track the log of a case and score it.

    Args:
        case: Case of the run.
        log: Log of the run, with ground truth.
        filter: One of `tracking.filters.FILTERS`.
        seed: Seed of the log.
        bound: Expected errors of an efficient estimator; None if cars join or leave, which the
            bound does not model.
    """
    constellation, block = log.constellation, log.block
    first, last = log.t_range
    t = log.truth.times()
    t = t[(t >= first) & (t <= last)]
    n_warm = int(np.searchsorted(block.t[0], first)) + WARM_UP
    warm = block.take(slice(0, n_warm))
    Tracker(constellation, filter=filter).step(warm, float(warm.t[0, -1]))

    tracker = Tracker(constellation, filter=filter)
    began = time.perf_counter()
    estimate = tracker.run(block, t).take(0)
    elapsed = time.perf_counter() - began

    truth, has_truth = log.truth.pairs(constellation, t)
    s = score(estimate, truth, has_truth, first + SKIP)
    turned = rotate(quat_from_yaw(-np.radians(s.yaw_deg or 0.0)), truth)
    gospa = labelled_gospa(estimate, turned, has_truth).total[t >= first + SKIP]
    end = float(log.truth.t.max())
    n_rounds = block.count(Kind.RANGE) / constellation.n_pairs
    return RunResult(
        case=case.name,
        scenario=case.scenario.name,
        filter=filter,
        seed=seed,
        nodes=constellation.n_nodes,
        rmse=_number(s.rmse),
        rmse_yaw=_number(s.rmse_yaw),
        rmse_shape=_number(s.rmse_shape),
        bound=None if bound is None else _number(bound.rmse),
        bound_yaw=None if bound is None else _number(bound.rmse_yaw),
        bound_shape=None if bound is None else _number(bound.rmse_shape),
        nees=_number(s.nees),
        nis=_number(float(tracker.mean_nis()[0])),
        gospa=_number(np.sqrt(np.mean(gospa**2))) if len(gospa) else None,
        coverage=s.coverage,
        ok_share=s.ok_share,
        integrity_share=s.integrity_share,
        integrity_worst_s=s.integrity_worst_s,
        converged_s=converged_at(estimate, first) - first,
        lost_s=lost_at(estimate, truth, has_truth, first),
        rejected=int(tracker.n_rejected()[0]),
        rounds_hz=n_rounds / (last - first),
        us_per_round=1e6 * elapsed / n_rounds,
        over_time=over_time(estimate, truth, has_truth, np.radians(s.yaw_deg or 0.0), end),
    )


def run_seed(case: Case, seed: int, filters: tuple[str, ...], seconds: float) -> list[RunResult]:
    """Run all filters on the log of one seed.

    Args:
        case: Case of the run.
        seed: Seed of the log; it determines all metrics except the run time.
        filters: Names in `tracking.filters.FILTERS`.
        seconds: Length of the run [s].
    """
    log = case.log(seed, seconds)
    stays = log.truth.pairs(log.constellation, log.truth.times())[1].all()
    bound = posterior_bound(log, case.bound_params(seed), skip=SKIP) if stays else None
    return [run(case, log, name, seed, bound) for name in filters]


def _number(value: float | None) -> float | None:
    """Return a finite number, or None."""
    return None if value is None or not np.isfinite(value) else float(value)


def _ratio(value: float | None, bound: float | None) -> float | None:
    return None if value is None or not bound else value / bound
