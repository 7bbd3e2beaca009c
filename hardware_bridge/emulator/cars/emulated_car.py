"""Emulated controller of a car: its motor command at any time."""

from __future__ import annotations

from hardware_bridge.emulator.cars.base import CarFirmware
from hardware_bridge.readings import DriveReading, Reading


class EmulatedCar:
    """Firmware with a dead man's switch. Pure: time is an argument `t_ns`, non-decreasing [ns].

    Invariant: after `deadman` without a motor command the speed is 0, for any earlier command.
    """

    def __init__(self, firmware: CarFirmware, deadman: float | None = None) -> None:
        """Create a controller at rest until the first command.

        Args:
            firmware: Decoder of the bytes.
            deadman: Timeout that replaces the firmware's own [s].
        """
        self.firmware = firmware
        self.deadman = firmware.deadman if deadman is None else deadman
        self._deadman_ns = round(self.deadman * 1e9)
        self._last: DriveReading | None = None
        self._last_ns = 0

    @property
    def last_ns(self) -> int | None:
        """[ns] Time of the last motor command."""
        return None if self._last is None else self._last_ns

    def feed(self, t_ns: int, data: bytes) -> list[DriveReading]:
        """Process bytes received at `t_ns`, and return the commands that they complete."""
        commands = self.firmware.feed(data)
        if commands:
            self._last = commands[-1]
            self._last_ns = t_ns
        return commands

    def is_stopped(self, t_ns: int) -> bool:
        """Return whether the dead man's switch has stopped the motor."""
        return self._last is None or t_ns - self._last_ns >= self._deadman_ns

    def command(self, t_ns: int) -> tuple[float, float]:
        """Return speed [m/s] and steering [rad]; the steering angle is kept at a stop."""
        if self._last is None:
            return 0.0, 0.0
        stopped = self._last.brake or self.is_stopped(t_ns)
        return 0.0 if stopped else self._last.speed, self._last.steering

    def encode(self, readings: list[Reading]) -> bytes:
        """Return the bytes to send, see `CarFirmware.encode`."""
        return self.firmware.encode(readings)
