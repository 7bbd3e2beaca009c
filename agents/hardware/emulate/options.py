"""What an emulation is made of: arguments, and what they are once they are looked up."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hardware_bridge.emulator.fault_plan import FaultPlan
from hardware_bridge.emulator.formats import WireFormat, check_formats, wire_format
from hardware_bridge.emulator.node import NodeParams
from hardware_bridge.errors import BridgeError
from hardware_bridge.readings import ImuReading
from hardware_bridge.wire.key import KEY_BYTES
from relpos_env.config import FormationConfig, Parts, whole_number
from relpos_env.errors import EnvError
from relpos_env.interface.beams import MOST_BEAMS
from relpos_env.scenarios import Scenario
from relpos_env.timing import DECISION

IMU_FORMAT = "witmotion"
"""Of the second port of nodes whose own format says nothing of motion."""
LONGEST = 86400.0
"""[s] Of an emulation."""


SLOW_PWM = {
    "forward": ((0.1, 1525), (3.0, 1750)),
    "reverse": ((0.1, 1475), (3.0, 1250)),
}
"""Cars behind PWM boards that can drive as slowly as a start asks for, both ways."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EmulateOptions:
    """One emulation. World, nodes and faults follow from these alone."""

    scenario: str | Path | Scenario | None = None
    """As in `relpos_env.config.FormationConfig`; by default that of the task."""
    task: str = "ring"
    """One of `relpos_env.tasks.TASKS`."""
    task_options: Mapping[str, Any] = field(default_factory=dict)
    """The task's own, by name."""
    cars: int | None = None
    """2 to 20; by default as many as the scenario has."""
    seed: int = 0
    """Of the episode, as of `relpos_env.api.parallel_env.FormationEnv.reset`."""
    seconds: float = 60.0
    """[s] From when the cars are let go; they stand for `relpos_env.timing.STAND_STILL` before."""
    format: str = "relpos"
    """What the nodes speak, see `hardware_bridge.emulator.formats`."""
    imu_format: str | None = None
    """What their second ports speak; by default `IMU_FORMAT` where it takes one, else none."""
    proximity: int = 0
    """Beams of distance sensors round each car, 0 to 32; cars with the driver ``relpos`` tell."""
    driver: str = "relpos"
    """Of the cars, one of `hardware_bridge.drivers.DRIVERS`."""
    driver_options: Mapping[str, Any] = field(default_factory=dict)
    """Fields of the driver's options, the same for all cars; by default `SLOW_PWM` for ``pwm``."""
    deadman: float | None = None
    """[s] In place of that of the cars' firmware."""
    key: bytes | None = None
    """16 bytes that sign messages of our own format; None signs none. Cars have `car_key`."""
    operator: bool = True
    """Emulate the operator's remote control, which asks for a velocity on top of the plan; else
    the plan alone is to be followed."""
    faults: FaultPlan = field(default_factory=FaultPlan)
    """What goes wrong."""
    nodes: NodeParams = field(default_factory=NodeParams)
    """How far the nodes' clocks are off."""

    def __post_init__(self) -> None:
        if self.driver == "pwm" and not self.driver_options:
            object.__setattr__(self, "driver_options", SLOW_PWM)
        if not DECISION <= self.seconds <= LONGEST:
            raise EnvError(f"seconds: expected {DECISION:g} to {LONGEST:g}, got {self.seconds!r}")
        whole_number("proximity", self.proximity, 0, MOST_BEAMS)
        whole_number("seed", self.seed, 0, (1 << 63) - 1)
        if self.key is not None and len(self.key) != KEY_BYTES:
            raise BridgeError(f"key: expected {KEY_BYTES} bytes, got {len(self.key)}")
        if self.deadman is not None and not 0.0 < self.deadman <= 60.0:
            raise BridgeError(f"deadman: expected above 0 and at most 60 s, got {self.deadman!r}")

    @property
    def car_key(self) -> bytes | None:
        """Signs what cars of our own format hear and say: every bit is that of `key` turned over.

        A car and its node have one id, so that with one key what one says could pass for the other.
        """
        if self.key is None or self.driver != "relpos":
            return None
        return bytes(byte ^ 0xFF for byte in self.key)

    @property
    def cycles(self) -> int:
        """Decisions from when the cars are let go."""
        return round(self.seconds / DECISION)

    def parts(self) -> Parts:
        """The world.

        Raises:
            EnvError: An unknown name or a number out of range.
        """
        return FormationConfig(
            scenario=self.scenario,
            task=self.task,
            task_options=self.task_options,
            n_cars=self.cars,
            proximity=self.proximity,
            max_cycles=self.cycles,
        ).resolve()

    def formats(self) -> tuple[WireFormat, ...]:
        """What the ports of a node speak.

        Raises:
            BridgeError: An unknown format, or none of them says distances or motion.
        """
        formats = [wire_format(self.format, self.key)]
        if self.imu_format is not None:
            formats.append(wire_format(self.imu_format, self.key))
        elif not formats[0].can_say(ImuReading):
            formats.append(wire_format(IMU_FORMAT))
        check_formats(tuple(formats))
        return tuple(formats)
