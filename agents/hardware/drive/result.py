"""Result of a drive with real cars."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from tracking.arrays import F64, I64, Bool
from tracking.params.short_repr import short_repr


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveResult:
    """One drive; arrays (decision, ...) begin when the cars were armed.

    A decision is one control step. Arrays hold at most the last ten minutes of a drive.
    """

    __repr__ = short_repr

    driver: str
    """Title of the controller or policy."""
    armed: bool
    """True if the cars were armed; False for a dry run."""
    t_ns: I64
    """[ns] Host time of the decisions, (decision)."""
    began_ns: int
    """[ns] Host time of the first decision of the drive."""
    target: F64
    """[m] Target positions relative to each car, (decision, slot, other, 2)."""
    has_target: Bool
    """True where the task defines a target, (decision, slot, other)."""
    error: F64
    """[m] Estimated formation error, mean over the cars, (decision)."""
    command: F64
    """Commanded speed [m/s] and steering [rad], (decision, slot, 2)."""
    passed: F64
    """Speed [m/s] and steering [rad] after the safety gate, (decision, slot, 2)."""
    lag: F64
    """[s] Latency from the last input byte of a decision to its command bytes, (decision)."""
    decisions: int
    """[-] Number of decisions of the whole drive."""
    late_decisions: int
    """[-] Decisions that were due while the previous one was still being computed."""
    missed_ticks: int
    """[-] Ticks of the supervisor that were more than 20 ms late."""
    recording_lost: str | None
    """Reason for missing records in the recording; None if complete or not recorded."""
    stops: tuple[str, ...]
    """Reasons of latched stops."""

    @property
    def seconds(self) -> float:
        """[s] Length of the drive."""
        return 1e-9 * float(self.t_ns[-1] - self.began_ns) if len(self.t_ns) else 0.0

    @property
    def summary(self) -> dict[str, Any]:
        """Figures of the drive as a JSON record."""
        lag = self.lag[np.isfinite(self.lag)]
        error = self.error[np.isfinite(self.error)]
        held = np.abs(self.passed - self.command).max(axis=(1, 2), initial=0.0) > 0.05
        return {
            "result": "drive",
            "driver": self.driver,
            "armed": self.armed,
            "seconds": round(self.seconds, 3),
            "decisions": self.decisions,
            "estimated_error": float(error.mean()) if len(error) else None,
            "lag_p50_ms": 1e3 * float(np.quantile(lag, 0.5)) if len(lag) else None,
            "lag_p99_ms": 1e3 * float(np.quantile(lag, 0.99)) if len(lag) else None,
            "gated_share": float(held.mean()) if self.armed and len(held) else None,
            "late_decisions": self.late_decisions,
            "missed_ticks": self.missed_ticks,
            "recording_lost": self.recording_lost,
            "stops": list(self.stops),
        }
