"""Result of an emulation."""

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
"""[s] Start of the interval over which errors are averaged, as in `agents.simulation.demo`."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EmulateResult:
    """Errors and statistics of one emulation."""

    __repr__ = short_repr

    scenario: str
    task: str
    seed: int
    seconds: float
    """[s] Length after the release of the cars."""
    t: F64
    """[s] Times of the updates of task and operator since the release, (decision)."""
    error: F64
    """[m] True formation error, mean over the present cars, (decision)."""
    collisions: int
    """[-] Collisions."""
    lateness: Lateness
    """Statistics of late steps."""
    lines: tuple[dict[str, Any], ...]
    """Name of each line, with its frames and bytes sent, read and lost."""
    start_ns: int
    """[ns] Host time of the start of the world, in which the cars rest at first."""
    happened: tuple[Fault, ...]
    """Injected faults of the script."""
    log: Log | None
    """Measurements with the truth; None if they were not recorded."""

    @property
    def formation_error(self) -> float:
        """[m] Mean error from `SETTLE` on, the last error of shorter runs, NaN without any."""
        known = self.error[np.isfinite(self.error)]
        settled = self.error[(self.t >= SETTLE) & np.isfinite(self.error)]
        if len(settled):
            return float(settled.mean())
        return float(known[-1]) if len(known) else math.nan

    @property
    def frames(self) -> int:
        """[-] Frames sent by all devices."""
        return sum(line["frames"] for line in self.lines)

    @property
    def summary(self) -> dict[str, Any]:
        """Figures of the emulation as a JSON record; unknown ones are None."""
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
    """Return the statistics of a line as a JSON record."""
    counts, injector = line.port.counts, line.injector
    return {
        "line": line.name,
        "frames": line.frames,
        "lost": injector.lost,
        "damaged": injector.damaged,
        "bytes": counts.written,
        "dropped": counts.dropped,
        "unread": counts.unread,
        "read": counts.read,
    }
