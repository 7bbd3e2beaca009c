"""Result of tracking a live swarm."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from tracking.arrays import I64
from tracking.estimate import TeamEstimate
from tracking.findings import Finding
from tracking.params.short_repr import short_repr


@dataclass(frozen=True, slots=True, kw_only=True)
class LiveResult:
    """Estimates and statistics of one run."""

    __repr__ = short_repr

    name: str
    """Name of the swarm."""
    start_ns: int
    """[ns] Host time of 0 s in the estimates."""
    seconds: float
    """[s] Time from the start to the last decision."""
    decisions: int
    late_decisions: int
    """[-] Decisions that were due while the previous one was still being computed."""
    t_ns: I64
    """[ns] Host time of the kept decisions, (decision)."""
    estimate: TeamEstimate
    """Estimates of the kept decisions, delayed by the horizon; arrays (decision, ...)."""
    counts: dict[str, Any] = field(default_factory=dict)
    """Measurements by kind, refused readings by reason, measurements later than the horizon."""
    streams: tuple[dict[str, Any], ...] = ()
    """Decoder statistics of each stream."""
    notices: tuple[tuple[float, str], ...] = ()
    """Notices to the user: time [s] and text."""
    findings: tuple[Finding, ...] = ()
    """Faults of the measurements (`docs/reference/findings.md`)."""
    recording: str | None = None
    """File of the recording; None if not recorded."""
    recording_lost: str | None = None
    """Reason for missing records in the recording; None if complete or not recorded."""

    @property
    def summary(self) -> dict[str, Any]:
        """Figures of the run as a JSON record."""
        return {
            "result": "live",
            "name": self.name,
            "start_ns": self.start_ns,
            "seconds": round(self.seconds, 6),
            "decisions": self.decisions,
            "late_decisions": self.late_decisions,
            **self.counts,
            "notices": len(self.notices),
            "findings": [found.record for found in self.findings],
            "recording": self.recording,
            "recording_lost": self.recording_lost,
        }
