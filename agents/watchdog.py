"""How long cars go on by themselves when they hear nothing.

Measured with their wheels off the ground: a car is told to drive until its own telemetry says that
it does, then it is told nothing, and the time until its wheels are at half that speed is taken.
"""

from __future__ import annotations

import math
import re
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hardware_bridge.config import SwarmConfig, parse_config
from hardware_bridge.config.swarm import CarConfig
from hardware_bridge.drivers import make_driver
from hardware_bridge.drivers.base import CarDriver
from hardware_bridge.errors import BridgeError
from hardware_bridge.links.links import Links
from hardware_bridge.readings import MotionReading
from hardware_bridge.safe_file import write_safely

SPEED = 0.5
"""[m/s] Asked of the wheels, or what the car needs at least."""
SPIN_UP, LONGEST = 5.0, 12.0
"""[s] In which the wheels must turn, and for which the car is listened to afterwards."""
STEP = 0.02
"""[s] Between commands."""
SECOND_NS = 1_000_000_000
GRAIN = 0.05
"""[s] What is measured is rounded up to multiples of it."""


@dataclass(frozen=True, slots=True)
class Watchdog:
    """Of one car."""

    car: int
    """Its node."""
    seconds: float | None
    """[s] From the last command until its wheels slow down; None if they did not, or could not."""
    problem: str
    """What is wrong; empty if nothing is."""

    @property
    def record(self) -> dict[str, Any]:
        """As a record."""
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
        config: Of the swarm.
        tell: Called with a line before each of them.

    Raises:
        BridgeError: There are no cars.
    """
    if not config.cars:
        raise BridgeError("cars: none in the configuration")
    found = []
    for car in config.cars:
        if tell is not None:
            tell(f"{car.port.name}: its wheels turn for up to {SPIN_UP + LONGEST:g} s")
        found.append(_measure(car))
    return found


def with_watchdogs(path: Path, found: Iterable[Watchdog]) -> None:
    """Write what was measured into swarm.toml.

    Args:
        path: Of the file.
        found: Cars without a measurement are left as they are.

    Raises:
        BridgeError: The file cannot be read or written, or has no table of such a car.
    """
    try:
        text = path.read_text(encoding="utf-8")
        for each in found:
            if each.seconds is not None and not each.problem:
                text = _set(text, each.car, each.seconds)
        parse_config(text, file=path.name, beside=path.parent)
        write_safely(path, text, mode=path.stat().st_mode & 0o777)
    except OSError as error:
        raise BridgeError(f"{path}: cannot be written ({error.strerror or error})") from error


def _set(text: str, car: int, seconds: float) -> str:
    """The text with the watchdog of a car.

    Raises:
        BridgeError: No table of the car.
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


def _measure(car: CarConfig) -> Watchdog:
    began = time.monotonic_ns()
    driver = make_driver(
        car.driver, car.node, car.options, car.key, time.time_ns() // SECOND_NS,
        lambda: (time.monotonic_ns() - began) // 1000,
    )  # fmt: skip
    links = Links([car.port], time.monotonic_ns)
    try:
        return _Trial(car, driver, links).run()
    finally:
        links.close()


class _Trial:
    """One car."""

    def __init__(self, car: CarConfig, driver: CarDriver, links: Links) -> None:
        self._car, self._driver, self._links = car, driver, links
        self._speed, self._said = 0.0, False

    def run(self) -> Watchdog:
        """Spin up, fall silent, listen."""
        name, driver = self._car.port.name, self._driver
        if not self._wait(lambda: self._links.is_up(name), 3.0):
            return self._result(None, "its port cannot be opened")
        self._links.send(name, driver.opening())
        speed = max(SPEED, 1.2 * driver.slowest)
        turns = self._wait(lambda: abs(self._speed) > 0.5 * speed, SPIN_UP, speed)
        turns = turns and self._wait(lambda: False, 0.5, speed) is False
        last, reached = time.monotonic(), abs(self._speed)
        if not self._said:
            self._stop()
            return self._result(
                None,
                "it says nothing of its speed: watch its wheels, and write watchdog into its table",
            )
        if not turns or reached < 0.3 * speed:
            self._stop()
            return self._result(None, "its wheels do not turn")
        stopped = self._wait(lambda: abs(self._speed) < 0.5 * reached, LONGEST)
        seconds = time.monotonic() - last
        self._stop()
        if not stopped:
            return self._result(None, f"it went on for {LONGEST:g} s: set its controller's timeout")
        return self._result(math.ceil(seconds / GRAIN) * GRAIN, "")

    def _wait(self, is_so: Callable[[], bool], seconds: float, speed: float | None = None) -> bool:
        """Listen until something is so, driving meanwhile if a speed [m/s] is given."""
        end, due = time.monotonic() + seconds, 0.0
        while (now := time.monotonic()) < end:
            if now >= due:
                due = now + STEP
                name = self._car.port.name
                if speed is not None:
                    self._links.send(name, self._driver.drive(speed, 0.0))
                self._links.send(name, self._driver.ask())
            for chunk in self._links.wait(STEP / 4):
                for reading in self._driver.telemetry.feed(chunk.data):
                    if isinstance(reading, MotionReading):
                        self._speed, self._said = reading.speed, True
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
