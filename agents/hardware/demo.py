"""Drive emulated cars through the whole stack, down to serial bytes, and compare with simulation.

The emulator is a separate process, or steps together with the drive under a virtual clock. The
drive is scored with the emulator's ground truth, which the drive does not use.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from agents.comparison.contender import Contender, find_entry
from agents.comparison.episode import run_episodes
from agents.comparison.setting import Setting
from agents.comparison.statistics import Interval, ratio
from agents.hardware.drive import DriveResult, drive, drive_on
from agents.hardware.emulate import EmulateOptions
from agents.hardware.emulate.process import LONGEST_START, EmulationProcess
from agents.hardware.emulate.virtual import START_NS, VirtualBridge
from agents.hardware.emulate.world import EmulatedWorld
from agents.simulation.demo import SETTLE
from relpos_env.timing import DECISION
from tracking.arrays import F64
from tracking.log import Log, read_log
from tracking.params.short_repr import short_repr


@dataclass(frozen=True, slots=True, kw_only=True)
class HardwareDemoResult:
    """One emulated drive and the same drive in the simulator."""

    __repr__ = short_repr

    seed: int
    drive: DriveResult
    log: Log
    """Measurements, with the ground truth."""
    t: F64
    """[s] Time since the start of the drive, (decision)."""
    error: F64
    """[m] True formation error, mean over the cars, (decision)."""
    simulated: F64
    """[m] True formation error of the same driver in the same simulated room, (decision)."""
    boxes: F64
    """Obstacles of the room at the start, (box, 6), as `relpos_env.world.world.World.boxes`."""
    collisions: int
    """[-] Collisions, start-up included."""
    simulated_collisions: int
    """[-] Collisions in the simulator."""
    late_steps: int
    """[-] Steps of the emulator more than 10 ms late, which disturb the drive."""
    virtual: bool = False
    """True if the drive ran in memory, under a virtual clock."""

    @property
    def summary(self) -> dict[str, Any]:
        """Figures of the comparison as a JSON record."""
        error = _settled(self.error[self.t >= SETTLE], self.error)
        simulated = _settled(self.simulated[round(SETTLE / DECISION) :], self.simulated)
        return {
            **self.drive.summary,
            "result": "hardware-demo",
            "seed": self.seed,
            "formation_error": error,
            "simulated_error": simulated,
            "ratio": None if error is None or simulated is None else error / simulated,
            "collisions": self.collisions,
            "simulated_collisions": self.simulated_collisions,
            "late_steps": self.late_steps,
            "virtual": self.virtual,
        }


def _settled(late: F64, every: F64) -> float | None:
    """Return the mean of `late`, or the last value of `every` if there is none, else None."""
    late = late[np.isfinite(late)]
    if len(late) == 0:
        late = every[np.isfinite(every)][-1:]
    return float(late.mean()) if len(late) else None


def error_ratio(results: Sequence[HardwareDemoResult]) -> Interval | None:
    """Return the ratio of mean formation errors, bridge over simulator, on the same seeds.

    Args:
        results: Results of different seeds.

    Returns:
        Ratio with its 95 % interval; None if no drive could be scored.
    """
    rows = [result.summary for result in results]
    ours = np.array([row["formation_error"] for row in rows], dtype=np.float64)
    return ratio(ours, np.array([row["simulated_error"] for row in rows], np.float64))


def hardware_demo(
    *,
    options: EmulateOptions,
    name: str = "consensus",
    folder: Path | str | None = None,
    virtual: bool = False,
    progress: Callable[[float], None] | None = None,
) -> HardwareDemoResult:
    """Drive emulated cars, and the same cars in the simulator.

    Args:
        options: Options of the emulation; `seconds` is the length of the drive.
        name: A controller or a policy, as for `relpos drive`.
        folder: Folder for the ports, the truth and the recording; by default a temporary one.
        virtual: Drive in memory, under a virtual clock and as fast as possible: the same bytes,
            without ports, processes and delays of the machine.
        progress: Called with the share done, 0 to 1.

    Raises:
        EnvError: An unknown name or a number out of range.
        BridgeError: The cars could not be armed.
        UsageError: No driver of that name, or it does not fit these cars.
    """
    entry = find_entry(name)
    contender = Contender(name, entry.trained_on or "estimate")
    setting = Setting(
        scenario=options.parts().scenario.name if options.scenario is None else options.scenario,  # type: ignore[arg-type]
        task=options.task,
        task_options=options.task_options,
        cars=options.cars,
        operator=float(options.operator),
        seconds=options.seconds,
    )
    simulated = run_episodes(contender, setting, [options.seed])[0]
    if virtual:
        drove = _drive_virtually(options, name, progress)
    else:
        with tempfile.TemporaryDirectory(prefix="relpos-") as scratch:
            drove = _drive_ports(options, name, Path(folder or scratch), progress)
    result, log = drove.result, drove.log
    t: F64 = np.asarray((result.t_ns - drove.start_ns) * 1e-9, dtype=np.float64)
    return HardwareDemoResult(
        seed=options.seed,
        drive=result,
        log=log,
        t=t - t[0] + DECISION if len(t) else t,
        error=true_error(result, log, t),
        simulated=simulated.error,
        boxes=EmulatedWorld(options.parts(), options.seed).swarm.boxes[0].copy(),
        collisions=drove.collisions,
        simulated_collisions=round(simulated.collisions_per_min * simulated.seconds / 60.0),
        late_steps=drove.late_steps,
        virtual=virtual,
    )


def true_error(result: DriveResult, log: Log, t: F64) -> F64:
    """Return the true formation error of a drive, mean over the cars, (decision) [m].

    Args:
        result: Drive with the targets.
        log: Log with the truth of the same nodes.
        t: Times of the decisions on the clock of the log, (decision) [s].
    """
    n = log.constellation.n_nodes
    times = log.truth.times()
    pos = log.truth.pos_w.reshape(len(times), n, 3)[:, :, :2]
    there = log.truth.valid.reshape(len(times), n)
    k = np.clip(np.searchsorted(times, t), 0, len(times) - 1)
    apart = pos[k][:, None, :] - pos[k][:, :, None]
    both = there[k][:, None, :] & there[k][:, :, None] & result.has_target
    off = np.linalg.norm(apart - result.target, axis=-1)
    counted = both.sum(axis=(1, 2))
    error: F64 = np.where(both, off, 0.0).sum(axis=(1, 2)) / np.maximum(counted, 1)
    return np.where((counted > 0) & (t <= times[-1]), error, np.nan)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Drove:
    """A drive with the log and the counters of the emulator."""

    result: DriveResult
    log: Log
    start_ns: int
    collisions: int
    late_steps: int = 0


def _drive_ports(
    options: EmulateOptions, name: str, place: Path, progress: Callable[[float], None] | None
) -> _Drove:
    """Drive in real time, through ports in a folder."""
    with EmulationProcess(options, place) as emulation:
        result = drive(
            config=place / "swarm.toml",
            name=name,
            arm=True,
            seconds=options.seconds,
            record=place / "drive.relpos",
            watch=_teller(options, progress),
        )
    return _Drove(
        result=result,
        log=read_log(place / "truth"),
        start_ns=emulation.start_ns,
        collisions=emulation.collisions,
        late_steps=emulation.late_steps,
    )


def _drive_virtually(
    options: EmulateOptions, name: str, progress: Callable[[float], None] | None
) -> _Drove:
    """Drive in memory, under a virtual clock."""
    longer = replace(options, seconds=options.seconds + LONGEST_START)
    bridge = VirtualBridge(longer, record=True)
    result = drive_on(
        lambda: bridge,
        bridge.config.n_slots,
        name=name,
        seconds=options.seconds,
        watch=_teller(options, progress),
    )
    log = bridge.rig.log(f"emulation-{options.seed}")
    collisions = bridge.rig.world.collisions
    return _Drove(result=result, log=log, start_ns=START_NS, collisions=collisions)


def _teller(
    options: EmulateOptions, progress: Callable[[float], None] | None
) -> Callable[[Any, Any], None]:
    """Return a callback that reports the share done after every control step."""

    def tell(_: Any, env: Any) -> None:
        if progress is not None:
            progress(min(env.group.cycles / options.cycles, 1.0))

    return tell
