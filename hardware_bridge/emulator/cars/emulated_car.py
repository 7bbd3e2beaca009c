"""A car's controller that is not there: what it would do with its motor at any time."""

from __future__ import annotations

from hardware_bridge.emulator.cars.base import CarFirmware
from hardware_bridge.readings import DriveReading, Reading


class EmulatedCar:
    """Firmware and its dead man's switch. Pure: time is an argument `t_ns` that never falls [ns].

    Law: without a command for the motor for `deadman`, the speed is 0, whatever came before.
    """

    def __init__(self, firmware: CarFirmware, deadman: float | None = None) -> None:
        """Stands still until the first command.

        Args:
            firmware: What reads the bytes.
            deadman: [s] In place of the firmware's own.
        """
        self.firmware = firmware
        self.deadman = firmware.deadman if deadman is None else deadman
        self._deadman_ns = round(self.deadman * 1e9)
        self._last: DriveReading | None = None
        self._last_ns = 0

    @property
    def last_ns(self) -> int | None:
        """[ns] When the last command for the motor came."""
        return None if self._last is None else self._last_ns

    def feed(self, t_ns: int, data: bytes) -> list[DriveReading]:
        """Take bytes that came at a time, and return the commands that they complete."""
        commands = self.firmware.feed(data)
        if commands:
            self._last = commands[-1]
            self._last_ns = t_ns
        return commands

    def is_stopped(self, t_ns: int) -> bool:
        """Whether the dead man's switch holds the motor."""
        return self._last is None or t_ns - self._last_ns >= self._deadman_ns

    def command(self, t_ns: int) -> tuple[float, float]:
        """Speed [m/s] and steering [rad] that it is at; it stops with the wheels as they are."""
        if self._last is None:
            return 0.0, 0.0
        stands = self._last.brake or self.is_stopped(t_ns)
        return 0.0 if stands else self._last.speed, self._last.steering

    def encode(self, readings: list[Reading]) -> bytes:
        """What the controller sends now, see `CarFirmware.encode`."""
        return self.firmware.encode(readings)
