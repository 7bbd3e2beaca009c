"""Evaluation of a suite over cases, seeds and filters (`relpos evaluate`)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from agents.errors import UsageError
from agents.evaluation.run import RunResult, run_seed
from agents.evaluation.suites import SUITES, Case, Suite
from agents.evaluation.targets import Outcome, outcomes
from agents.jobs import check_jobs, find_engine
from tracking.errors import ConfigError
from tracking.filters import FILTERS, filter_builder
from tracking.params.short_repr import short_repr

MEDIANS = ("rmse", "rmse_yaw", "rmse_shape", "bound", "bound_yaw", "bound_shape")
"""[m] Metrics that are summarised by their medians over the seeds."""
SHORTEST, LONGEST = 15.0, 1800.0
"""[s] The first ten seconds are not scored; the simulation of a person is limited to 1800 s."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CaseResult:
    """One case and filter over all seeds: medians of errors, means of consistency."""

    __repr__ = short_repr

    suite: str
    case: Case
    filter: str
    runs: tuple[RunResult, ...]
    """Runs by seed."""

    @property
    def paper(self) -> float | None:
        """Error reported by the paper [m]."""
        return self.case.paper.get(self.filter)

    @property
    def targets(self) -> list[Outcome]:
        """Targets of this filter in this case, with the results."""
        figures = {name: self.median(name) for name in MEDIANS}
        return outcomes(self.case.asked.get(self.filter, {}), figures)

    @property
    def record(self) -> dict[str, Any]:
        """Metrics for JSON; None where they could not be scored."""
        ratios = ("ratio_bound", "ratio_shape")
        return {
            "suite": self.suite,
            "case": self.case.name,
            "scenario": self.case.scenario.name,
            "filter": self.filter,
            "nodes": self.runs[0].nodes,
            "seeds": len(self.runs),
            **{name: self.median(name) for name in (*MEDIANS, *ratios)},
            "lost_runs": sum(r.lost for r in self.runs),
            "nees": _mean(r.nees for r in self.runs),
            "nis": _mean(r.nis for r in self.runs),
            "gospa": self.median("gospa"),
            "coverage": _mean(r.coverage for r in self.runs),
            "ok_share": _mean(r.ok_share for r in self.runs),
            "integrity_share": _mean(r.integrity_share for r in self.runs),
            "integrity_worst_s": max(self.values("integrity_worst_s"), default=None),
            "us_per_round": self.median("us_per_round"),
            "paper": self.paper,
            "targets": [target.record for target in self.targets],
        }

    def values(self, name: str) -> list[float]:
        """Return a metric of every run in which it is defined.

        Args:
            name: Field of `RunResult`.
        """
        found = (getattr(r, name) for r in self.runs)
        return [v for v in found if v is not None]

    def median(self, name: str) -> float | None:
        """Return the median of a metric over the runs in which it is defined.

        Args:
            name: Field of `RunResult`.
        """
        values = self.values(name)
        return float(np.median(values)) if values else None


@dataclass(frozen=True, slots=True, kw_only=True)
class EvaluateResult:
    """Result of a suite."""

    __repr__ = short_repr

    suite: Suite
    filters: tuple[str, ...]
    seeds: int
    seconds: float
    """[s] Length of each run."""
    cases: tuple[CaseResult, ...]
    """Results by case, then filter."""

    @property
    def by_case(self) -> list[tuple[Case, list[CaseResult]]]:
        """Cases with the results of all filters."""
        return [(case, [c for c in self.cases if c.case is case]) for case in self.suite.cases]

    @property
    def records(self) -> list[dict[str, Any]]:
        """One flat record per case and filter."""
        return [c.record for c in self.cases]

    @property
    def run_records(self) -> list[dict[str, Any]]:
        """One flat record per run."""
        return [{"suite": c.suite, **r.record} for c in self.cases for r in c.runs]


def evaluate(
    *,
    suite: str | Suite = "paper",
    filters: Sequence[str] = tuple(FILTERS),
    seeds: int | None = None,
    seconds: float | None = None,
    jobs: int = 1,
    engine: str = "local",
    address: str | None = None,
    ready: Callable[[], None] = lambda: None,
    progress: Callable[[float], None] = lambda share: None,
) -> EvaluateResult:
    """Track simulated runs of every case and seed with every filter, and score them.

    With more than one job the calling script must be importable: put its code below
    `if __name__ == "__main__"`, and functions that change logs into modules.

    Args:
        suite: One of `agents.evaluation.suites.SUITES`, or a custom suite.
        filters: Names in `tracking.filters.FILTERS`.
        seeds: Number of runs per case, with seeds 0, 1, ...; by default that of the suite.
        seconds: Length of a run [s]; by default that of the suite.
        jobs: Parallel processes. Only the measured time per round depends on it.
        engine: One of `agents.jobs.ENGINES`.
        address: Address of a running cluster, see `agents.jobs.find_engine`.
        ready: Called when the arguments have been checked, before the first run.
        progress: Called with the completed share, 0 to 1.

    Raises:
        UsageError: A name is unknown, a number out of range, or there are too many jobs for the
            machine; the message contains the option.
    """
    chosen = suite if isinstance(suite, Suite) else find_suite(suite)
    names = check_filters(filters)
    seeds = chosen.seeds if seeds is None else seeds
    seconds = chosen.seconds if seconds is None else seconds
    if not 1 <= seeds <= 100_000:
        raise UsageError(f"--seeds: expected 1 to 100000, got {seeds}")
    if not SHORTEST <= seconds <= LONGEST:
        raise UsageError(f"--seconds: expected {SHORTEST:g} to {LONGEST:g}, got {seconds:g}")
    check_jobs(jobs)
    work = find_engine(engine, address)
    tasks = [(case, seed, names, seconds) for seed in range(seeds) for case in chosen.cases]
    ready()
    progress(0.0)
    done: dict[tuple[str, int], list[RunResult]] = {}
    for n, runs in work(run_seed, tasks, jobs):
        case, seed, _, _ = tasks[n]
        done[case.name, seed] = runs
        progress(len(done) / len(tasks))
    cases = tuple(
        CaseResult(
            suite=chosen.name,
            case=case,
            filter=name,
            runs=tuple(done[case.name, seed][k] for seed in range(seeds)),
        )
        for case in chosen.cases
        for k, name in enumerate(names)
    )
    return EvaluateResult(suite=chosen, filters=names, seeds=seeds, seconds=seconds, cases=cases)


def find_suite(name: str) -> Suite:
    """Return a suite by its name.

    Args:
        name: One of `SUITES`.

    Raises:
        UsageError: There is no suite of that name.
    """
    if name not in SUITES:
        raise UsageError(f"--suite: expected one of {', '.join(SUITES)}, got {name!r}")
    return SUITES[name]


def check_filters(names: Iterable[str]) -> tuple[str, ...]:
    """Return the filter names in order, without duplicates.

    Args:
        names: Names in `tracking.filters.FILTERS`.

    Raises:
        UsageError: A filter does not exist, or there are no names.
    """
    chosen = tuple(dict.fromkeys(names))
    if not chosen:
        raise UsageError(f"--filter: expected names of {', '.join(FILTERS)}, got none")
    try:
        for name in chosen:
            filter_builder(name)
    except ConfigError as error:
        raise UsageError(f"--{error}") from error
    return chosen


def _mean(values: Iterable[float | None]) -> float | None:
    found = [v for v in values if v is not None]
    return float(np.mean(found)) if found else None
