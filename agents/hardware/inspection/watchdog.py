"""Measure the watchdog of each car: the time from its last command until its wheels slow down.

The wheels must be off the ground. Commands are sent until the telemetry reports the speed, and
then stop. The result is the time until the telemetry reports half that speed.
"""

from __future__ import annotations

import math
import re
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hardware_bridge.config import SwarmConfig, parse_config
from hardware_bridge.config.swarm import CarConfig
from hardware_bridge.drivers import make_driver
from hardware_bridge.drivers.base import CarDriver
from hardware_bridge.errors import BridgeError
from hardware_bridge.ingest.intake import Intake
from hardware_bridge.links.links import Links
from hardware_bridge.live.marks import KeptMarks
from hardware_bridge.readings import MotionReading
from hardware_bridge.safe_file import write_safely
from hardware_bridge.wire.key import REMOVED_KEY

SPEED = 0.5
"""[m/s] Commanded wheel speed; larger if the minimum speed of the car requires it."""
SPIN_UP, LONGEST = 5.0, 12.0
"""[s] Longest time until the wheels turn, and from the last command until they slow down."""
STEP = 0.02
"""[s] Period of commands."""
SECOND_NS = 1_000_000_000
GRAIN = 0.05
"""[s] Resolution to which results are rounded up."""
STEADY = 0.5
"""[s] Time at speed before the last command."""
IN_A_ROW = 3
"""[-] Consecutive slow readings that end a measurement."""


@dataclass(frozen=True, slots=True)
class Watchdog:
    """Watchdog of one car."""

    car: int
    """Id of its node."""
    seconds: float | None
    """[s] Time from the last command until the wheels slow down; None if not measured."""
    problem: str
    """Problem and remedy; empty if there is none."""

    @property
    def record(self) -> dict[str, Any]:
        """JSON record."""
        return {
            "result": "watchdog",
            "car": self.car,
            "seconds": self.seconds,
            "problem": self.problem,
        }


def measure_watchdogs(
    config: SwarmConfig, *, tell: Callable[[str], None] | None = None
) -> list[Watchdog]:
    """Measure all cars of a swarm, one after the other. Their wheels turn.

    Args:
        config: Configuration of the swarm.
        tell: Called with a line of text before each car.

    Raises:
        BridgeError: There are no cars, or the keys were removed, as in a recording.
    """
    if REMOVED_KEY in config.keys:
        raise BridgeError('key: "removed", expected the keys that a recording does not hold')
    if not config.cars:
        raise BridgeError("cars: none in the configuration")
    found, boot = [], _boot(config)
    for car in config.cars:
        if tell is not None:
            tell(f"{car.port.name}: its wheels turn for up to {SPIN_UP + LONGEST:g} s")
        found.append(_measure(car, boot))
    return found


def with_watchdogs(path: Path, found: Iterable[Watchdog]) -> None:
    """Write the measured watchdogs into swarm.toml.

    Args:
        path: Path of the file.
        found: Watchdogs; cars without a measurement are left unchanged.

    Raises:
        BridgeError: The file cannot be read or written, or has no table for a car.
    """
    try:
        text = path.read_text(encoding="utf-8")
        for each in found:
            if each.seconds is not None and not each.problem:
                text = _set(text, each.car, each.seconds)
        parse_config(text, file=path.name, folder=path.parent)
        write_safely(path, text, mode=path.stat().st_mode & 0o777)
    except OSError as error:
        raise BridgeError(f"{path}: cannot be written ({error.strerror or error})") from error


def _set(text: str, car: int, seconds: float) -> str:
    """Return the text with the watchdog of a car.

    Raises:
        BridgeError: No table for the car.
    """
    lines = text.splitlines()
    head = re.compile(rf"\s*\[\s*cars\s*\.\s*\"?{car}\"?\s*\]")
    at = next((k for k, line in enumerate(lines) if head.match(line)), None)
    if at is None:
        raise BridgeError(f"cars.{car}: expected a table [cars.{car}] to write its watchdog into")
    line, k = f"watchdog = {seconds:g}", at + 1
    while k < len(lines) and not lines[k].lstrip().startswith("["):
        if re.match(r"\s*watchdog\s*=", lines[k]):
            lines[k] = line
            return "\n".join(lines) + "\n"
        k += 1
    lines.insert(at + 1, line)
    return "\n".join(lines) + "\n"


def _boot(config: SwarmConfig) -> int:
    """Return the boot number of the commands, higher than that of any earlier start."""
    wall_s = time.time_ns() // SECOND_NS
    if config.marks is None:
        return wall_s
    return KeptMarks(config.marks, Intake(config, 0), wall_s).boot


def _measure(car: CarConfig, boot: int) -> Watchdog:
    began = time.monotonic_ns()
    driver = make_driver(
        car.driver, car.node, car.options, car.key, boot,
        lambda: (time.monotonic_ns() - began) // 1000,
    )  # fmt: skip
    links = Links([car.port], time.monotonic_ns)
    try:
        return _Trial(car, driver, links).run()
    finally:
        links.close()


class _Trial:
    """Measurement of one car."""

    def __init__(self, car: CarConfig, driver: CarDriver, links: Links) -> None:
        self._car, self._driver, self._links = car, driver, links
        self._speeds: list[tuple[float, float]] = []
        """Time [s] and speed [m/s] of its telemetry readings."""
        self._commanded_at = 0.0

    def run(self) -> Watchdog:
        """Spin the wheels up, stop sending commands, and measure the time until they slow down."""
        name, driver = self._car.port.name, self._driver
        if not self._wait(lambda: self._links.is_up(name), 3.0):
            return self._result(None, "its port cannot be opened")
        self._links.send(name, driver.opening())
        try:
            return self._measure(max(SPEED, 1.2 * driver.slowest))
        finally:
            # The watchdog is unknown: only this stops the car, also after an exception.
            self._stop()

    def _measure(self, speed: float) -> Watchdog:
        """Measure with a commanded speed [m/s]."""
        turns = self._wait(lambda: self._speeds != [] and self._at() > 0.5 * speed, SPIN_UP, speed)
        if turns:
            self._wait(lambda: False, STEADY, speed)
        if not self._speeds:
            return self._result(
                None,
                "it says nothing of its speed: watch its wheels, and write watchdog into its table",
            )
        since = time.monotonic() - STEADY
        reached = float(np.median([abs(v) for t, v in self._speeds if t >= since] or [0.0]))
        if not turns or reached < 0.3 * speed:
            return self._result(None, "its wheels do not turn")
        self._speeds.clear()

        def slow() -> list[bool]:
            return [abs(v) < 0.5 * reached for _, v in self._speeds[-IN_A_ROW:]]

        if not self._wait(lambda: len(slow()) == IN_A_ROW and all(slow()), LONGEST):
            return self._result(None, f"it went on for {LONGEST:g} s: set its controller's timeout")
        seconds = self._speeds[-IN_A_ROW][0] - self._commanded_at
        return self._result(math.ceil(seconds / GRAIN) * GRAIN, "")

    def _at(self) -> float:
        """Return the magnitude of the last reported speed [m/s]."""
        return abs(self._speeds[-1][1])

    def _wait(self, is_so: Callable[[], bool], seconds: float, speed: float | None = None) -> bool:
        """Wait for `is_so`, driving at `speed` [m/s] if given; return whether it holds in time."""
        end, due = time.monotonic() + seconds, 0.0
        while (now := time.monotonic()) < end:
            if now >= due:
                due = now + STEP
                name = self._car.port.name
                if speed is not None:
                    self._links.send(name, self._driver.drive(speed, 0.0))
                    self._commanded_at = now
                self._links.send(name, self._driver.ask())
            for chunk in self._links.wait(STEP / 4):
                for reading in self._driver.telemetry.feed(chunk.data):
                    if isinstance(reading, MotionReading):
                        self._speeds.append((time.monotonic(), reading.speed))
            if is_so():
                return True
        return False

    def _stop(self) -> None:
        for _ in range(10):
            self._links.send(self._car.port.name, self._driver.neutral())
            time.sleep(STEP)

    def _result(self, seconds: float | None, problem: str) -> Watchdog:
        rounded = None if seconds is None else round(seconds, 3)
        return Watchdog(self._car.node, rounded, problem)
