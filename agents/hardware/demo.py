"""Emulated cars driven through the whole path, serial bytes and all, next to the simulator.

The emulator is a process of its own, or steps together with the drive under a virtual clock; its
truth scores the drive, which knows nothing of it.
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
    """One emulated drive and its twin in the simulator."""

    __repr__ = short_repr

    seed: int
    drive: DriveResult
    log: Log
    """What was measured, with the truth."""
    t: F64
    """Since the drive began, (decision) [s]."""
    error: F64
    """Formation error by the truth, mean over the cars, (decision) [m]."""
    simulated: F64
    """That of the same driver in the same room of the simulator, (decision) [m]."""
    boxes: F64
    """What stood in the room at the start, (box, 6), as `relpos_env.world.world.World.boxes`."""
    collisions: int
    """[-] That cars began, start included."""
    simulated_collisions: int
    """[-] In the simulator."""
    late_steps: int
    """[-] Of the emulator, by more than 10 ms: what it then did was no fault of the drive."""
    virtual: bool = False
    """Whether it was driven in memory, under a virtual clock."""

    @property
    def summary(self) -> dict[str, Any]:
        """The figures."""
        error = _settled(self.error[self.t >= SETTLE], self.error)
        twin = _settled(self.simulated[round(SETTLE / DECISION) :], self.simulated)
        return {
            **self.drive.summary,
            "result": "hardware-demo",
            "seed": self.seed,
            "formation_error": error,
            "simulated_error": twin,
            "ratio": None if error is None or twin is None else error / twin,
            "collisions": self.collisions,
            "simulated_collisions": self.simulated_collisions,
            "late_steps": self.late_steps,
            "virtual": self.virtual,
        }


def _settled(late: F64, every: F64) -> float | None:
    """Mean of what came after settling; at the end where a drive was over before; None for none."""
    late = late[np.isfinite(late)]
    if len(late) == 0:
        late = every[np.isfinite(every)][-1:]
    return float(late.mean()) if len(late) else None


def error_ratio(results: Sequence[HardwareDemoResult]) -> Interval | None:
    """Mean formation error through the bridge over that in the simulator, on the same seeds.

    Args:
        results: Of different seeds.

    Returns:
        With its 95 % interval; None without any drive that could be scored.
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
    """Emulate cars, drive them, and drive their twins in the simulator.

    Args:
        options: The emulation; its `seconds` are those of the drive.
        name: A controller or a policy, as for `relpos drive`.
        folder: For the ports, the truth and the recording; by default one that is thrown away.
        virtual: In memory and under a virtual clock, as fast as it goes: the same bytes, without
            ports, processes and what a machine makes late.
        progress: Called with the share done, 0 to 1.

    Raises:
        EnvError: An unknown name or a number out of range.
        BridgeError: The cars could not be armed.
        UsageError: No driver of that name, or not for such cars.
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
    twin = run_episodes(contender, setting, [options.seed])[0]
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
        simulated=twin.error,
        boxes=EmulatedWorld(options.parts(), options.seed).swarm.boxes[0].copy(),
        collisions=drove.collisions,
        simulated_collisions=round(twin.collisions_per_min * twin.seconds / 60.0),
        late_steps=drove.late_steps,
        virtual=virtual,
    )


def true_error(result: DriveResult, log: Log, t: F64) -> F64:
    """Formation error of a drive by the truth, mean over the cars, (decision) [m].

    Args:
        result: What was wanted when.
        log: With the truth of the same nodes.
        t: Times of the decisions by the log's clock, (decision) [s].
    """
    n = log.constellation.n_nodes
    times = log.truth.times()
    pos = log.truth.pos_w.reshape(len(times), n, 3)[:, :, :2]
    there = log.truth.valid.reshape(len(times), n)
    k = np.clip(np.searchsorted(times, t), 0, len(times) - 1)
    apart = pos[k][:, None, :] - pos[k][:, :, None]
    both = there[k][:, None, :] & there[k][:, :, None] & result.wanted
    off = np.linalg.norm(apart - result.target, axis=-1)
    counted = both.sum(axis=(1, 2))
    error: F64 = np.where(both, off, 0.0).sum(axis=(1, 2)) / np.maximum(counted, 1)
    return np.where((counted > 0) & (t <= times[-1]), error, np.nan)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Drove:
    """A drive and what the emulator says of it."""

    result: DriveResult
    log: Log
    start_ns: int
    collisions: int
    late_steps: int = 0


def _drive_ports(
    options: EmulateOptions, name: str, place: Path, progress: Callable[[float], None] | None
) -> _Drove:
    """In real time, with ports in a folder."""
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
    """In memory."""
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
    """What tells of the share done after every decision."""

    def tell(_: Any, env: Any) -> None:
        if progress is not None:
            progress(min(env.group.cycles / options.cycles, 1.0))

    return tell
