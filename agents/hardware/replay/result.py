"""What came of replaying a recording."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from agents.evaluation.track import pair_name
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
    """A replay against the truth."""

    __repr__ = short_repr

    score: Score
    offset: float
    """[s] Added to times of the truth."""
    truth_ij_w: F64
    """True relative positions at the times of the estimates, (decision, pair, 3) [m]."""
    has_truth: Bool
    """(decision, pair)"""
    errors: F64
    """Distance of the estimate from it after the constant yaw of `score`, (decision, pair) [m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ReplayResult:
    """One replay."""

    __repr__ = short_repr

    recording: Recording
    """Torn or damaged ones are used as far as they go."""
    config: SwarmConfig
    """The recorded one."""
    calibration: Calibration | None
    """The recorded one, by which measurements were corrected."""
    decisions: int
    """How many there were."""
    t_ns: I64
    """Host time of the decisions, (decision) [ns]."""
    estimate: TeamEstimate
    """At each of them, as old as the horizon; arrays over (decision, ...)."""
    block: MeasurementBlock
    """What was measured, as it came, without calibration, if it was asked for."""
    last: Snapshot
    """What is known at the end."""
    counts: dict[str, Any]
    """Measurements by kind, refused readings by reason, measurements later than the horizon."""
    streams: tuple[dict[str, Any], ...]
    """Of each stream what its decoder met."""
    notices: tuple[tuple[float, str], ...]
    """Time [s] and what the user was told then."""
    lost: tuple[tuple[float, int, str], ...]
    """Where the recorder had to drop records: time [s], how many, why."""
    stopped: bool
    """Whether the replay was ended before the recording did."""
    realtime_factor: float
    """[-] Recorded time over the time that the replay took."""
    scored: Scored | None = None

    @property
    def seconds(self) -> float:
        """From the start to the last decision [s]."""
        return self.last.t

    @property
    def flaws(self) -> list[str]:
        """Why this is not all that happened, in words."""
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
        """The figures, ready for JSON."""
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
