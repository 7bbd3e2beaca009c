"""Log of the latest control steps of a drive, in a ring buffer of fixed size."""

from __future__ import annotations

import numpy as np

from agents.hardware.drive.result import DriveResult
from hardware_bridge.live.env import HardwareFormationEnv
from hardware_bridge.live.opened import OpenBridge

MOST_KEPT = 6000
"""[-] Capacity in control steps (ten minutes); a recording holds all steps."""
STOPPED = " stopped: "


class DriveLog:
    """Ring buffer of control steps."""

    def __init__(
        self, title: str, bridge: OpenBridge, env: HardwareFormationEnv, cycles: int
    ) -> None:
        """Allocate the arrays.

        Args:
            title: Title of the driver.
            bridge: Bridge to the cars.
            env: Environment of the drive.
            cycles: Largest number of control steps.
        """
        self._title, self._bridge, self._env = title, bridge, env
        self._n, self._n_late, self._began_ns = 0, 0, 0
        n, room = bridge.config.n_slots, min(cycles, MOST_KEPT)
        self._is_driven = np.zeros(n)
        self._is_driven[[bridge.config.slot_of(car) for car in bridge.config.cars]] = 1.0
        self._t_ns = np.full(room, -1, dtype=np.int64)
        self._target = np.full((room, n, n, 2), np.nan)
        self._has_target = np.full((room, n, n), True)
        self._error, self._lag = np.full((2, room), np.nan)
        self._command, self._passed = np.full((2, room, n, 2), np.nan)

    def first(self) -> None:
        """Store the number of late steps at the start of the drive."""
        self._n_late = self._bridge.feed.n_late

    def add(self) -> None:
        """Append the state after a control step."""
        group, report = self._env.group, self._bridge.feed.report
        present, task = group.estimated.present[0], group.task
        k = self._n % len(self._t_ns)
        self._began_ns = self._began_ns if self._n else group.t_ns
        self._n += 1
        self._t_ns[k] = group.t_ns
        self._target[k], self._has_target[k] = task.target[0], task.has_target[0]
        self._error[k] = task.error[0, present].mean() if present.any() else np.nan
        self._command[k] = group.asked * self._is_driven[:, None]
        self._passed[k] = 0.0
        self._lag[k] = np.nan
        if report is not None:
            self._passed[k, :, 0], self._passed[k, :, 1] = report.speed, report.steering
            self._lag[k] = report.lag if report.lag > 0.0 else np.nan

    def result(self, armed: bool) -> DriveResult:
        """Return the logged drive.

        Args:
            armed: Whether the cars were armed.
        """
        report, room = self._bridge.feed.report, len(self._t_ns)
        order = np.arange(max(self._n - room, 0), self._n) % max(room, 1)
        notices = [text for _, text in self._bridge.feed.notices]
        return DriveResult(
            driver=self._title,
            armed=armed,
            t_ns=self._t_ns[order],
            began_ns=self._began_ns,
            target=self._target[order],
            has_target=self._has_target[order],
            error=self._error[order],
            command=self._command[order],
            passed=self._passed[order],
            lag=self._lag[order],
            decisions=self._n,
            late_decisions=self._bridge.feed.n_late - self._n_late,
            missed_ticks=report.missed if report is not None else 0,
            recording_lost=self._bridge.recording_lost,
            stops=tuple(text for text in notices if STOPPED in text),
        )
