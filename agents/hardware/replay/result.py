"""Result of replaying a recording."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from agents.evaluation.estimates_csv import pair_name
from agents.hardware.live.snapshot import Snapshot
from hardware_bridge.config import SwarmConfig
from hardware_bridge.recording import Recording
from tracking.arrays import F64, I64, Bool
from tracking.calibration.calibration import Calibration
from tracking.estimate import TeamEstimate
from tracking.measurements import MeasurementBlock
from tracking.metrics.score import Score
from tracking.params.short_repr import short_repr


@dataclass(frozen=True, slots=True, kw_only=True)
class Scored:
    """Errors of a replay against the ground truth."""

    __repr__ = short_repr

    score: Score
    offset: float
    """[s] Offset added to times of the truth."""
    truth_ij_w: F64
    """[m] True relative positions at the times of the estimates, (decision, pair, 3)."""
    has_truth: Bool
    """True where the truth is known, (decision, pair)."""
    errors: F64
    """[m] Position errors after the constant yaw of `score` is removed, (decision, pair)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ReplayResult:
    """Estimates and statistics of one replay."""

    __repr__ = short_repr

    recording: Recording
    """Recording; the readable part of a truncated or damaged one."""
    config: SwarmConfig
    """Recorded configuration."""
    calibration: Calibration | None
    """Recorded calibration, which was applied to the measurements."""
    decisions: int
    """[-] Number of decisions."""
    t_ns: I64
    """[ns] Host time of the decisions, (decision)."""
    estimate: TeamEstimate
    """Estimates of the decisions, delayed by the horizon; arrays (decision, ...)."""
    block: MeasurementBlock
    """Uncalibrated measurements; empty if they were not kept."""
    last: Snapshot
    """Snapshot after the last decision."""
    counts: dict[str, Any]
    """Measurements by kind, refused readings by reason, measurements later than the horizon."""
    streams: tuple[dict[str, Any], ...]
    """Decoder statistics of each stream."""
    notices: tuple[tuple[float, str], ...]
    """Notices to the user: time [s] and text."""
    lost: tuple[tuple[float, int, str], ...]
    """Records that the recorder dropped: time [s], number, reason."""
    stopped: bool
    """True if the replay was stopped before the end of the recording."""
    realtime_factor: float
    """[-] Recorded time divided by the duration of the replay."""
    scored: Scored | None = None

    @property
    def seconds(self) -> float:
        """[s] Time from the start to the last decision."""
        return self.last.t

    @property
    def flaws(self) -> list[str]:
        """Reasons why the replay is incomplete, as text."""
        r = self.recording
        flaws = [f"the replay was stopped after {self.seconds:.1f} s"] if self.stopped else []
        if r.torn:
            flaws.append("it ends within a record: the process or the machine was ended")
        if r.damaged:
            flaws.append(f"{r.damaged} damaged places, {r.missing} records missing")
        for t, n, why in self.lost:
            flaws.append(f"{n} records were not written from {t:.1f} s on: {why}")
        return flaws

    @property
    def summary(self) -> dict[str, Any]:
        """Figures of the replay as a JSON record."""
        r, s = self.recording, self.scored
        figures: dict[str, Any] = {
            "result": "replay",
            "recording": str(r.path),
            "software": r.header.software,
            "name": self.config.name,
            "filter": self.config.tracker.filter,
            "start_ns": r.header.monotonic_ns,
            "seconds": round(self.seconds, 6),
            "decisions": self.decisions,
            "records": r.n_records,
            "torn": r.torn,
            "damaged": r.damaged,
            "missing": r.missing,
            "stopped": self.stopped,
            "dropped": sum(n for _, n, _ in self.lost),
            **self.counts,
            "notices": len(self.notices),
            "realtime_factor": self.realtime_factor,
        }
        if s is not None:
            group = self.estimate.constellation
            rmse = s.score.pair_rmse
            figures |= {
                "truth_offset": s.offset,
                "rmse": s.score.rmse,
                "rmse_yaw": s.score.rmse_yaw,
                "yaw_deg": s.score.yaw_deg,
                "rmse_shape": s.score.rmse_shape,
                "pair_rmse": {
                    pair_name(group, p): float(rmse[p])
                    for p in range(group.n_pairs)
                    if np.isfinite(rmse[p])
                },
                "nees": s.score.nees,
                "coverage": s.score.coverage,
                "ok_share": s.score.ok_share,
            }
        return figures
