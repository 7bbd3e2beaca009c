"""What came of an emulation."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from agents.hardware.emulate.pace import Lateness
from hardware_bridge.emulator.fault_plan import Fault
from hardware_bridge.emulator.line import Line
from tracking.arrays import F64
from tracking.log import Log
from tracking.params.short_repr import short_repr

SETTLE = 10.0
"""[s] Errors are averaged from here on, as in `agents.simulation.demo`."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EmulateResult:
    """One emulation."""

    __repr__ = short_repr

    scenario: str
    task: str
    seed: int
    seconds: float
    """[s] From when the cars were let go."""
    t: F64
    """When task and operator looked at the room, since the cars were let go, (decision) [s]."""
    error: F64
    """Formation error by the truth, mean over the cars in the room, (decision) [m]."""
    collisions: int
    """[-] That cars began."""
    lateness: Lateness
    """How well the steps kept to their times."""
    lines: tuple[dict[str, Any], ...]
    """Of each line its name, frames and bytes that were sent, read and lost."""
    start_ns: int
    """[ns] Host time of the world's beginning, in which the cars stand at first."""
    happened: tuple[Fault, ...]
    """Faults of the script."""
    log: Log | None
    """What was measured, with the truth, where it was asked for."""

    @property
    def formation_error(self) -> float:
        """Mean from `SETTLE` on, or of the end if it came before [m]; NaN before any."""
        known = self.error[np.isfinite(self.error)]
        settled = self.error[(self.t >= SETTLE) & np.isfinite(self.error)]
        if len(settled):
            return float(settled.mean())
        return float(known[-1]) if len(known) else math.nan

    @property
    def frames(self) -> int:
        """Sent by all devices."""
        return sum(line["frames"] for line in self.lines)

    @property
    def summary(self) -> dict[str, Any]:
        """The figures, without what is not known."""
        error = self.formation_error
        return {
            "result": "emulation",
            "scenario": self.scenario,
            "task": self.task,
            "seed": self.seed,
            "seconds": self.seconds,
            "formation_error": None if math.isnan(error) else error,
            "collisions": self.collisions,
            "start_ns": self.start_ns,
            "late_steps": self.lateness.late,
            "worst_late_ms": 1e-6 * self.lateness.worst_ns,
            "frames": self.frames,
            "faults": len(self.happened),
        }


def line_figures(line: Line) -> dict[str, Any]:
    """What went over a line."""
    counts, injector = line.port.counts, line.injector
    return {
        "line": line.name,
        "frames": line.frames,
        "lost": injector.lost,
        "damaged": injector.damaged,
        "bytes": counts.written,
        "dropped": counts.dropped,
        "unheard": counts.unheard,
        "read": counts.read,
    }
