"""Options of an emulation, and the world and formats that they select."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hardware_bridge.config.alone import TASKS_ALONE
from hardware_bridge.emulator.fault_plan import FaultPlan
from hardware_bridge.emulator.formats import WireFormat, check_formats, wire_format
from hardware_bridge.emulator.node import NodeParams
from hardware_bridge.errors import BridgeError
from hardware_bridge.readings import ImuReading
from hardware_bridge.wire.key import KEY_BYTES
from relpos_env.config import FormationConfig, Parts, whole_number
from relpos_env.core.tracked_world import Trackers
from relpos_env.errors import EnvError
from relpos_env.interface.rangefinders import MAX_RANGEFINDERS
from relpos_env.scenarios import Scenario
from relpos_env.timing import DECISION

IMU_FORMAT = "witmotion"
"""Default format of the second port of nodes whose own format has no IMU samples."""
LONGEST = 86400.0
"""[s] Longest emulation."""


NOT_EMULATED = ("escort", "seek", "inspect")
"""Tasks that drive a car themselves, or need its estimates."""

SLOW_PWM = {
    "forward": ((0.1, 1525), (3.0, 1750)),
    "reverse": ((0.1, 1475), (3.0, 1250)),
}
"""Calibration of PWM cars that can drive at the low speeds of the start-up, in both directions."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EmulateOptions:
    """Options of one emulation, which determine world, nodes and faults completely."""

    scenario: str | Path | Scenario | None = None
    """Scenario, as in `relpos_env.config.FormationConfig`; by default that of the task."""
    task: str = "ring"
    """Task, one of `relpos_env.tasks.TASKS`."""
    task_options: Mapping[str, Any] = field(default_factory=dict)
    """Options of the task by name."""
    cars: int | None = None
    """[-] Number of cars, 2 to 20; by default that of the scenario."""
    seed: int = 0
    """[-] Seed of the episode, as of `relpos_env.api.parallel_env.FormationEnv.reset`."""
    seconds: float = 60.0
    """[s] Length after the release of the cars, at `relpos_env.timing.STAND_STILL`."""
    trackers: Trackers = "group"
    """``own``: each node also sends what its radio received of the others, for a tracker on its
    own car; there is no operator then, and a ``swarm-ID.toml`` for each car."""
    format: str = "relpos"
    """Format of the nodes, see `hardware_bridge.emulator.formats`."""
    imu_format: str | None = None
    """Format of their second ports; by default `IMU_FORMAT` if a node needs one, else none."""
    proximity: int = 0
    """[-] Distance sensors per car, 0 to 32; only cars with the driver ``relpos`` report them."""
    driver: str = "relpos"
    """Driver of the cars, one of `hardware_bridge.drivers.DRIVERS`."""
    driver_options: Mapping[str, Any] = field(default_factory=dict)
    """Options of the driver for all cars; by default `SLOW_PWM` for ``pwm``."""
    deadman: float | None = None
    """[s] Command timeout that replaces that of the cars' firmware."""
    key: bytes | None = None
    """Key of 16 bytes for messages of our own format; None signs none. Cars have `car_key`."""
    operator: bool = True
    """True to emulate the operator's remote control, which adds a velocity to the plan."""
    faults: FaultPlan = field(default_factory=FaultPlan)
    """Faults to inject."""
    nodes: NodeParams = field(default_factory=NodeParams)
    """Clock errors and battery reports of the nodes."""

    def __post_init__(self) -> None:
        if self.driver == "pwm" and not self.driver_options:
            object.__setattr__(self, "driver_options", SLOW_PWM)
        if self.trackers == "own":
            object.__setattr__(self, "operator", False)
            if self.format != "relpos":
                raise BridgeError(f"format: expected relpos with own trackers, got {self.format!r}")
            if self.task not in TASKS_ALONE:
                expected = ", ".join(sorted(set(TASKS_ALONE) - set(NOT_EMULATED)))
                raise BridgeError(
                    f"task: expected one of {expected} with own trackers, got {self.task!r}"
                )
        if self.task in NOT_EMULATED:
            raise BridgeError(
                f"task: {self.task!r} is not emulated: cars that drive by themselves and estimates "
                "are not part of the emulated world"
            )
        if not DECISION <= self.seconds <= LONGEST:
            raise EnvError(f"seconds: expected {DECISION:g} to {LONGEST:g}, got {self.seconds!r}")
        whole_number("proximity", self.proximity, 0, MAX_RANGEFINDERS)
        whole_number("seed", self.seed, 0, (1 << 63) - 1)
        if self.key is not None and len(self.key) != KEY_BYTES:
            raise BridgeError(f"key: expected {KEY_BYTES} bytes, got {len(self.key)}")
        if self.deadman is not None and not 0.0 < self.deadman <= 60.0:
            raise BridgeError(f"deadman: expected above 0 and at most 60 s, got {self.deadman!r}")

    @property
    def car_key(self) -> bytes | None:
        """Key of messages to and from cars of our own format: the inverted bits of `key`.

        A car and its node have the same id; with the same key, messages of one could pass as those
        of the other.
        """
        if self.key is None or self.driver != "relpos":
            return None
        return bytes(byte ^ 0xFF for byte in self.key)

    @property
    def cycles(self) -> int:
        """Number of control steps after the release of the cars."""
        return round(self.seconds / DECISION)

    def parts(self) -> Parts:
        """Return the parts of the world.

        Raises:
            EnvError: An unknown name or a number out of range.
        """
        return FormationConfig(
            scenario=self.scenario,
            task=self.task,
            task_options=self.task_options,
            n_cars=self.cars,
            proximity=self.proximity,
            trackers=self.trackers,
            max_cycles=self.cycles,
        ).resolve()

    def formats(self) -> tuple[WireFormat, ...]:
        """Return the formats of the ports of a node.

        Raises:
            BridgeError: An unknown format, or no format with ranges or with IMU samples.
        """
        formats = [wire_format(self.format, self.key)]
        if self.imu_format is not None:
            formats.append(wire_format(self.imu_format, self.key))
        elif not formats[0].can_say(ImuReading):
            formats.append(wire_format(IMU_FORMAT))
        check_formats(tuple(formats))
        return tuple(formats)
