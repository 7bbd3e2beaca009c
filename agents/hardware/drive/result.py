"""What came of a drive with real cars."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from tracking.arrays import F64, I64, Bool
from tracking.params.short_repr import short_repr


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveResult:
    """One drive; arrays over (decision, ...), from when the cars were armed on.

    Of drives of more than ten minutes they have the last decisions only.
    """

    __repr__ = short_repr

    driver: str
    """The controller or policy."""
    armed: bool
    """Whether the cars were; else it was a dry run."""
    t_ns: I64
    """Host time of the decisions, (decision) [ns], whole numbers."""
    began_ns: int
    """Host time of the first of all [ns]."""
    target: F64
    """Where the others should have been, (decision, slot, other, 2) [m]."""
    wanted: Bool
    """False where the task gave no place, (decision, slot, other)."""
    error: F64
    """Formation error that the cars believed in, mean over them, (decision) [m]."""
    command: F64
    """What was asked for: speed [m/s] and steering [rad], (decision, slot, 2)."""
    passed: F64
    """What the gate let pass, (decision, slot, 2)."""
    lag: F64
    """From the last byte that a decision rests on to its command's bytes, (decision) [s]."""
    decisions: int
    """[-] All of them."""
    late_decisions: int
    """[-] That were due while the one before was still made."""
    missed_ticks: int
    """[-] Of the supervisor, more than 20 ms late."""
    recording_lost: str | None
    """Why records are missing in the recording; None if none are, or there is none."""
    stops: tuple[str, ...]
    """Why cars were stopped for good."""

    @property
    def seconds(self) -> float:
        """Length [s]."""
        return 1e-9 * float(self.t_ns[-1] - self.began_ns) if len(self.t_ns) else 0.0

    @property
    def summary(self) -> dict[str, Any]:
        """The figures."""
        lag = self.lag[np.isfinite(self.lag)]
        error = self.error[np.isfinite(self.error)]
        held = np.abs(self.passed - self.command).max(axis=(1, 2), initial=0.0) > 0.05
        return {
            "result": "drive",
            "driver": self.driver,
            "armed": self.armed,
            "seconds": round(self.seconds, 3),
            "decisions": self.decisions,
            "believed_error": float(error.mean()) if len(error) else None,
            "lag_p50_ms": 1e3 * float(np.quantile(lag, 0.5)) if len(lag) else None,
            "lag_p99_ms": 1e3 * float(np.quantile(lag, 0.99)) if len(lag) else None,
            "gated_share": float(held.mean()) if self.armed and len(held) else None,
            "late_decisions": self.late_decisions,
            "missed_ticks": self.missed_ticks,
            "recording_lost": self.recording_lost,
            "stops": list(self.stops),
        }
