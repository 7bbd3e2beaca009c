"""Run an emulation in real time."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from agents.hardware.emulate.interrupts import Interrupts
from agents.hardware.emulate.options import EmulateOptions
from agents.hardware.emulate.pace import Lateness, Pace
from agents.hardware.emulate.result import EmulateResult, line_figures
from agents.hardware.emulate.rig import STEP_NS, TRUTH_EVERY, EmulatedRig
from agents.hardware.emulate.warm_up import warm_up
from hardware_bridge.pauses import short_pauses
from relpos_env.errors import EnvError
from relpos_env.registry import name_of
from relpos_env.timing import DECISION, STAND_STILL
from tracking.log import check_target, write_log

SECOND = round(1e9 / STEP_NS)
"""[-] Steps between reports, one second."""
LONGEST_WAIT = 3600.0
"""[s] Upper limit of `wait`."""


Report = Callable[[dict[str, Any]], None]


def emulate(
    *,
    folder: Path | str,
    options: EmulateOptions | None = None,
    wait: float = 0.0,
    log: Path | str | None = None,
    ready: Callable[[EmulatedRig], None] | None = None,
    report: Report | None = None,
    clock: Callable[[], int] = time.monotonic_ns,
    sleep: Callable[[float], None] = time.sleep,
    **changes: Any,
) -> EmulateResult:
    """Run devices in a simulated world in real time, until the time is up or Ctrl-C.

    KeyboardInterrupt ends the run between two steps. After the run, further interrupts are
    ignored until the log is written completely.

    Args:
        folder: Folder for the ports and ``swarm.toml``.
        options: Options of the emulation.
        wait: Longest time the world is paused until a host has sent bytes to a car [s].
        log: Folder for the measurements with the truth; None writes no log.
        ready: Called when the ports can be opened.
        report: Called every second with a record of figures.
        clock: Monotonic clock [ns].
        sleep: Sleeps for a number of seconds.
        changes: Fields of `EmulateOptions` that differ from `options`.

    Raises:
        EnvError: An unknown name or a number out of range.
        BridgeError: An unknown device or option, or a port that cannot be created.
        LogError: `log` exists already.
    """
    chosen = replace(options or EmulateOptions(), **changes)
    if not 0.0 <= wait <= LONGEST_WAIT:
        raise EnvError(f"wait: expected 0 to {LONGEST_WAIT:g} s, got {wait!r}")
    if log is not None:
        check_target(Path(log))
    warm_up(chosen)
    n_steps = round(1e9 * (STAND_STILL + DECISION * chosen.cycles)) // STEP_NS
    with Interrupts() as interrupts:
        rig = EmulatedRig(chosen, Path(folder), record=log is not None)
        run = _Run(rig, report)
        try:
            with interrupts.allowed():
                if ready is not None:
                    ready(rig)
                _wait_for_host(rig, wait, clock, sleep)
            with short_pauses():
                pace = Pace(STEP_NS, clock, sleep)
                run.lateness = pace.lateness
                for _ in range(n_steps):
                    with interrupts.allowed():
                        t_ns = pace.wait()
                    run.step(t_ns)
                    with interrupts.allowed():
                        run.tell()
        except KeyboardInterrupt:
            pass
        finally:
            rig.close()
        result = run.result(f"emulation-{chosen.seed}")
        if log is not None and result.log is not None:
            write_log(Path(log), result.log)
    return result


class _Run:
    """Log of a running rig."""

    def __init__(self, rig: EmulatedRig, report: Report | None) -> None:
        self.rig, self._report = rig, report
        self.lateness = Lateness()
        self.start_ns = 0
        self._rows: list[tuple[float, float]] = []
        self._frames = 0

    def step(self, t_ns: int) -> None:
        """Advance the rig by 10 ms."""
        world = self.rig.world
        self.start_ns = self.start_ns or t_ns - STEP_NS
        self.rig.step(t_ns)
        if world.just_judged:
            self._rows.append((world.t - STAND_STILL, world.error))

    def tell(self) -> None:
        """Report once per second of the world."""
        if self._report is not None and round(self.rig.world.t * 1e9 / STEP_NS) % SECOND == 0:
            self._report(self._second())

    def result(self, name: str) -> EmulateResult:
        """Return the result of the run."""
        rig = self.rig
        parts, world = rig.world.parts, rig.world
        t, error = np.array(self._rows, dtype=np.float64).reshape(-1, 2).T
        log = None
        if world.recording is not None and self.lateness.steps >= TRUTH_EVERY:
            log = rig.log(name)
        return EmulateResult(
            scenario=parts.scenario.name,
            task=name_of(parts.config.task),
            seed=rig.options.seed,
            seconds=max(world.t - STAND_STILL, 0.0),
            t=t,
            error=error,
            collisions=world.collisions,
            lateness=self.lateness,
            start_ns=self.start_ns,
            lines=tuple(line_figures(line) for line in rig.emulator.lines),
            happened=tuple(rig.emulator.happened),
            log=log,
        )

    def _second(self) -> dict[str, Any]:
        """Return a record of the last second."""
        world = self.rig.world
        frames = sum(line.frames for line in self.rig.emulator.lines)
        frames, self._frames = frames - self._frames, frames
        last = self._rows[-SECOND * STEP_NS // round(1e9 * DECISION) :]
        errors = [error for _, error in last if math.isfinite(error)]
        return {
            "result": "second",
            "t": round(world.t - STAND_STILL, 3),
            "formation_error": float(np.mean(errors)) if errors else None,
            "collisions": world.collisions,
            "late_steps": self.lateness.late,
            "frames": frames,
            "faults": len(self.rig.emulator.happened),
        }


def _wait_for_host(
    rig: EmulatedRig, seconds: float, clock: Callable[[], int], sleep: Callable[[float], None]
) -> None:
    """Wait until a car has received bytes, at most `seconds`."""
    end = clock() + round(1e9 * seconds)
    while clock() < end and not rig.emulator.listen(clock()):
        sleep(1e-9 * STEP_NS)
