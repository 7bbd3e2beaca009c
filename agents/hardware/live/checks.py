"""Checks of the recent measurements of a live swarm, in a process of its own.

They are those of a recording (`tracking.findings.examine`): axes, units, clocks and calibration. A
check takes seconds of processor time, so it must not run in the process that tracks.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import tempfile
from collections import deque
from dataclasses import replace
from pathlib import Path

from tracking.calibration.calibration import Calibration
from tracking.constellation import Constellation
from tracking.findings import KINDS, Finding, examine
from tracking.log import Log
from tracking.measurements import Kind, MeasurementBlock

PERIOD = 30.0
"""[s] Time between two checks."""
WINDOW = 60.0
"""[s] Age up to which measurements are checked."""
FEWEST = 200
"""[-] Number of ranges below which nothing is checked."""


class Checks:
    """Repeated checks of a swarm while it runs."""

    def __init__(self, name: str, group: Constellation, calibration: Calibration | None) -> None:
        """Begin without measurements.

        Args:
            name: Name of the swarm.
            group: Its nodes.
            calibration: Calibration of the sensors; None uses measurements as received.
        """
        self._name, self._group, self._calibration = name, group, calibration
        self._parts: deque[tuple[float, MeasurementBlock]] = deque()
        self._folder = tempfile.TemporaryDirectory(prefix="relpos-checks-")
        self._process: subprocess.Popen[bytes] | None = None
        self._due = PERIOD
        self._is_over = False
        self.findings: list[Finding] = []
        """Errors and warnings found, each kind and node once. Notes are about the time before the
        window, or about what the user has configured."""

    def step(self, now: float, block: MeasurementBlock) -> list[str]:
        """Add measurements, start a check that is due, and return new notices.

        Args:
            now: Time since the start [s].
            block: Measurements since the last call, without calibration; copied.
        """
        self._parts.append((now, block.env(0)))
        while self._parts[0][0] < now - WINDOW:
            self._parts.popleft()
        if self._process is not None and self._process.poll() is not None:
            return self._take_findings(self._process)
        if self._process is None and now >= self._due and not self._is_over:
            self._due = now + PERIOD
            try:
                self._start()
            except OSError as error:
                return self._end(str(error))
        return []

    def close(self) -> None:
        """End a check that runs."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
        self._folder.cleanup()

    def _start(self) -> None:
        block = MeasurementBlock.concatenate([part for _, part in self._parts]).sorted()
        if (block.kind == Kind.RANGE).sum() < FEWEST:
            return
        if self._calibration is not None:
            block = self._calibration.apply(block, self._group)
        log = Log(name=self._name, constellation=self._group, block=block)
        self._file.write_bytes(pickle.dumps(log))
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", __name__, str(self._file)],
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip

    def _take_findings(self, process: subprocess.Popen[bytes]) -> list[str]:
        self._process = None
        if process.returncode != 0:
            return self._end(f"status {process.returncode}")
        try:
            found: list[Finding] = pickle.loads(self._file.read_bytes())
        except (OSError, EOFError, pickle.UnpicklingError) as error:
            return self._end(str(error))
        known = {(f.name, f.nodes) for f in self.findings}
        new = [f for f in found if (f.name, f.nodes) not in known and f.severity != "note"]
        self.findings += [_uncorrected(f) for f in new]
        return [f"{f.text}: {KINDS[f.name].remedy}" for f in map(_uncorrected, new)]

    def _end(self, why: str) -> list[str]:
        """End the checks, which would fail again and must not end the run; return the notice."""
        self._is_over = True
        return [f"measurements are no longer checked: {why}"]

    @property
    def _file(self) -> Path:
        return Path(self._folder.name) / "measurements"


def _uncorrected(found: Finding) -> Finding:
    """Return a finding of a swarm, whose measurements are used as they come."""
    return replace(found, text=found.text.replace(", corrected", ", not corrected while live"))


def check(file: Path) -> None:
    """Replace a pickled log by its findings; for the process of a check."""
    os.nice(10)
    _, findings = examine(pickle.loads(file.read_bytes()))
    file.write_bytes(pickle.dumps(findings))


if __name__ == "__main__":
    check(Path(sys.argv[1]))
