"""What came of listening to a live swarm."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from tracking.arrays import I64
from tracking.estimate import TeamEstimate
from tracking.params.short_repr import short_repr


@dataclass(frozen=True, slots=True, kw_only=True)
class LiveResult:
    """One run."""

    __repr__ = short_repr

    name: str
    """Of the swarm."""
    start_ns: int
    """[ns] Host time that is 0 s of the estimates."""
    seconds: float
    """[s] Until the last decision."""
    decisions: int
    late_decisions: int
    """[-] That were due while the one before was still made."""
    t_ns: I64
    """Host time of the decisions that were kept, (decision) [ns]."""
    estimate: TeamEstimate
    """At each of them, as old as the horizon; arrays over (decision, ...)."""
    counts: dict[str, Any] = field(default_factory=dict)
    """Measurements by kind, refused readings by reason, measurements later than the horizon."""
    streams: tuple[dict[str, Any], ...] = ()
    """Of each stream what its decoder met."""
    notices: tuple[tuple[float, str], ...] = ()
    """Time [s] and what the user was told."""
    recording: str | None = None
    """The file."""
    recording_lost: str | None = None
    """Why records are missing in it; None if it has them all."""

    @property
    def summary(self) -> dict[str, Any]:
        """The figures, ready for JSON."""
        return {
            "result": "live",
            "name": self.name,
            "start_ns": self.start_ns,
            "seconds": round(self.seconds, 6),
            "decisions": self.decisions,
            "late_decisions": self.late_decisions,
            **self.counts,
            "notices": len(self.notices),
            "recording": self.recording,
            "recording_lost": self.recording_lost,
        }
