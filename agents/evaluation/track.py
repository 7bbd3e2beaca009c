"""Tracking of a recorded run (`relpos track`)."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from agents.evaluation.estimates_csv import pair_name
from tracking.arrays import F64, Bool
from tracking.constellation import Constellation
from tracking.errors import ConfigError
from tracking.estimate import TeamEstimate
from tracking.filters import DEFAULT_FILTER
from tracking.findings import Finding, examine, find_in_estimates, refuse_errors
from tracking.late_data.horizon import HorizonParams
from tracking.log import Log, read_log
from tracking.measurements import MeasurementBlock
from tracking.metrics.bound import Bound
from tracking.metrics.score import Score, score
from tracking.params.short_repr import short_repr
from tracking.tracker import Tracker, TrackerParams
from tracking.whole_smoother import smooth_whole

CSV_HZ = 20.0
"""[Hz] Rate of estimates.csv."""
ERRORS = ("rmse", "rmse_yaw", "rmse_shape", "rmse_mirror")
"""Errors of a run, in display order."""
LAG = HorizonParams().delay
"""[s] Lag of the fixed-lag smoother."""
Smoothing = Literal["lag", "all"]
N_CHUNKS = 50
"""Number of chunks in which a log is tracked, for progress reports."""


@dataclass(frozen=True, slots=True)
class TrackResult:
    """One log tracked by one filter."""

    __repr__ = short_repr

    log: Log
    filter: str
    estimate: TeamEstimate
    """Estimates over (time, pair), at `CSV_HZ`."""
    truth_ij_w: F64
    """[m] True relative positions at the times of `estimate`, (time, pair, 3)."""
    has_truth: Bool
    """True where `truth_ij_w` is known, (time, pair)."""
    score: Score
    """Score at the times of the ground truth."""
    nis: float
    """[-] Mean NIS of accepted ranges."""
    n_rejected: int
    """Ranges rejected by the gate."""
    skip: float
    """[s] Time after the first range that is not scored."""
    range_noise: float | None
    """[m] White noise of the ranges, given by the log or learned; None for other filters than
    `joint` and for a smoothed log."""
    realtime_factor: float
    """[-] Duration of the log divided by the run time of tracking."""
    bound: Bound | None = None
    """Expected errors of an efficient filter, which does not use later measurements, if
    requested."""
    smooth: Smoothing | None = None
    """Smoothing, see `track_log`; None for a filter."""
    findings: tuple[Finding, ...] = ()
    """Problems of the recording and of its tracking."""

    @property
    def method(self) -> str:
        """Filter and smoothing, such as "joint, smoothed"."""
        return (
            self.filter
            + {None: "", "lag": ", smoothed with a lag", "all": ", smoothed"}[self.smooth]
        )

    @property
    def summary(self) -> dict[str, Any]:
        """Metrics for JSON; None where they could not be scored."""
        constellation, s = self.log.constellation, self.score
        pair_rmse = {
            pair_name(constellation, p): _number(s.pair_rmse[p])
            for p in range(constellation.n_pairs)
            if np.isfinite(s.pair_rmse[p])
        }
        return {
            "log": self.log.name,
            "filter": self.filter,
            "smooth": self.smooth,
            "nodes": constellation.n_nodes,
            "duration_s": self.log.duration,
            "ranges": self.log.n_ranges,
            "rmse": _number(s.rmse),
            "rmse_yaw": _number(s.rmse_yaw),
            "yaw_deg": _number(s.yaw_deg),
            "rmse_shape": _number(s.rmse_shape),
            "rmse_mirror": _number(s.rmse_mirror),
            **{f"bound_{name}": value for name, value in self.expected.items()},
            "pair_rmse": pair_rmse,
            "nees": _number(s.nees),
            "nis": _number(self.nis),
            "range_noise_m": _number(self.range_noise),
            "realtime_factor": _number(self.realtime_factor),
            "coverage": s.coverage,
            "ok_share": s.ok_share,
            "integrity_share": s.integrity_share,
            "integrity_worst_s": s.integrity_worst_s,
            "protection_share": s.protection_share,
            "findings": [f.record for f in self.findings],
            "rejected": self.n_rejected,
            "skipped": sum(self.log.skipped.values()),
        }

    @property
    def expected(self) -> dict[str, float]:
        """Bounds by the names of the errors [m]; empty if not requested."""
        if self.bound is None:
            return {}
        return {name: float(getattr(self.bound, name)) for name in ERRORS if name != "rmse_mirror"}


def track_log(
    log: Log | Path | str,
    *,
    filter: str = DEFAULT_FILTER,
    skip: float = 10.0,
    smooth: Smoothing | None = None,
    bound: Bound | None = None,
    params: TrackerParams | None = None,
    findings: Sequence[Finding] | None = None,
    progress: Callable[[float], None] | None = None,
) -> TrackResult:
    """Track a recorded run and score it where ground truth exists.

    Args:
        log: A log, or its folder.
        filter: One of `tracking.filters.FILTERS`.
        skip: Time after the first range that is not scored [s].
        smooth: Fixed-lag smoothing over `LAG` ("lag"), or smoothing over the whole log ("all",
            `tracking.whole_smoother`); None for filtering.
        bound: Expected errors of an efficient filter, copied to the result
            (`tracking.metrics.bound.recorded_bound`).
        params: Parameters of the tracker.
        findings: Results of `tracking.findings.examine` for this log; an empty sequence uses the
            log as it is; None examines it, and corrects clocks and gyroscopes.
        progress: Called with the completed share, 0 to 1.

    Raises:
        LogError: The folder cannot be read, or estimates would be wrong (`refuse_errors`).
        ConfigError: The filter does not exist or cannot smooth, or an argument is out of range.
    """
    if smooth not in (None, "lag", "all"):
        raise ConfigError(f"smooth: expected None, 'lag' or 'all', got {smooth!r}")
    if not 0.0 <= skip < float("inf"):
        raise ConfigError(f"skip: expected 0 or more seconds, got {skip!r}")
    log = log if isinstance(log, Log) else read_log(log)
    if findings is None:
        log, findings = examine(log)
        refuse_errors(findings)
    constellation, block = log.constellation, log.block
    params = params_for(log, params or TrackerParams())
    tracker = Tracker(constellation, params, filter=filter)
    first, last = log.t_range
    # Integer multiples of the period, so that large times remain on the grid.
    grid = first + np.arange(int((last - first) * CSV_HZ) + 1) / CSV_HZ
    t_truth = log.truth.times()
    t_truth = t_truth[(t_truth >= first) & (t_truth <= last)]
    t_out = np.union1d(grid, t_truth)

    started = time.perf_counter()
    if smooth == "all":
        if filter != DEFAULT_FILTER:
            raise ConfigError(f"smooth: expected filter '{DEFAULT_FILTER}', got '{filter}'")
        estimate, nis, n_rejected = smooth_whole(constellation, block, t_out, params, progress)
        noise = None
    else:
        estimate = _in_parts(tracker, block, t_out, smooth is not None, progress)
        nis, n_rejected = float(tracker.mean_nis()[0]), int(tracker.n_rejected()[0])
        noise = tracker.range_noise()
    elapsed = time.perf_counter() - started

    found = (*findings, *find_in_estimates(log, estimate, n_rejected))
    truth, has_truth = log.truth.pairs(constellation, t_out)
    at_truth = np.isin(t_out, t_truth)
    on_grid = np.isin(t_out, grid)
    return TrackResult(
        log=log,
        filter=filter,
        estimate=_at_times(estimate, on_grid),
        truth_ij_w=truth[on_grid],
        has_truth=has_truth[on_grid],
        score=score(
            _at_times(estimate, at_truth), truth[at_truth], has_truth[at_truth], first + skip
        ),
        nis=nis,
        n_rejected=n_rejected,
        skip=skip,
        range_noise=None if noise is None else float(noise[0]),
        realtime_factor=log.duration / max(elapsed, 1e-9),
        bound=bound,
        smooth=smooth,
        findings=found,
    )


def params_for(log: Log, params: TrackerParams) -> TrackerParams:
    """Return parameters whose `joint` takes the range noise and the accuracy that a log gives.

    A noise that is given is not learned; an accuracy of the parameters goes first.
    """
    joint = params.filter.joint
    if log.range_noise is not None:
        joint = replace(
            joint,
            range_error=replace(joint.range_error, white_std=log.range_noise),
            noise_learning=replace(joint.noise_learning, learns=False),
        )
    if joint.accuracy is None:
        joint = replace(joint, accuracy=log.accuracy)
    return replace(params, filter=replace(params.filter, joint=joint))


def _in_parts(
    tracker: Tracker,
    block: MeasurementBlock,
    t_out: F64,
    smooth: bool,
    progress: Callable[[float], None] | None,
) -> TeamEstimate:
    """Track a log in chunks with progress reports; return arrays over (time, ...)."""
    edges = np.linspace(block.t[0, 0], block.t[0, -1], N_CHUNKS + 1)[1:]
    edges[-1] = max(block.t[0, -1], t_out[-1])
    parts, event, out = [], 0, 0
    for k, edge in enumerate(edges):
        # An estimate uses every event up to its time, so both are split at the same edge.
        next_event = int(np.searchsorted(block.t[0], edge, side="right"))
        next_out = int(np.searchsorted(t_out, edge, side="right"))
        chunk, times = slice(event, next_event), t_out[out:next_out]
        if smooth:
            parts.append(_smoothed(tracker, block, chunk, times))
        else:
            parts.append(tracker.run(block.take(chunk), times))
        event, out = next_event, next_out
        if progress is not None:
            progress((k + 1) / N_CHUNKS)
    return _join(tracker.constellation, parts)


def _smoothed(tracker: Tracker, block: MeasurementBlock, chunk: slice, t_out: F64) -> TeamEstimate:
    """Track the events of a chunk; return estimates smoothed with the next `LAG` of events."""
    event, found = chunk.start, []
    for t in t_out:
        now, later = np.searchsorted(block.t[0], [t, t + LAG], side="right")
        tracker.step(block.take(slice(event, now)), t)
        found.append(tracker.smooth(block.take(slice(now, later)), t))
        event = now
    rest = tracker.run(block.take(slice(event, chunk.stop)), np.empty(0))
    if not found:
        return rest
    names = TeamEstimate.__slots__[1:]
    stacked = (np.stack([getattr(e, n) for e in found], axis=1) for n in names)
    return TeamEstimate(rest.constellation, *stacked)


def _join(constellation: Constellation, parts: Sequence[TeamEstimate]) -> TeamEstimate:
    """Concatenate runs in time and remove the env axis."""
    names = TeamEstimate.__slots__[1:]
    joined = (np.concatenate([getattr(part, n)[0] for part in parts]) for n in names)
    return TeamEstimate(constellation, *joined)


def _at_times(estimate: TeamEstimate, chosen: Bool) -> TeamEstimate:
    arrays = (getattr(estimate, n)[chosen] for n in TeamEstimate.__slots__[1:])
    return TeamEstimate(estimate.constellation, *arrays)


def _number(value: float | None) -> float | None:
    """Return a finite number, or None."""
    return None if value is None or not np.isfinite(value) else float(value)
