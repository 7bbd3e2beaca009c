"""Firmware of an emulated PWM board, its servo and motor: lines of two pulses to commands."""

from __future__ import annotations

import re

from hardware_bridge.counts import Counts
from hardware_bridge.drivers.pwm import LEAST_PULSE, MOST_PULSE, PwmOptions, speed_of
from hardware_bridge.emulator.cars.base import DEADMAN
from hardware_bridge.readings import UNNAMED, DriveReading, Reading

_LINE = re.compile(rb"\s*(\d{4}), *(\d{4})\s*")
_LONGEST = 64
"""[bytes] Longest valid line; longer ones are damaged."""


class PwmFirmware:
    """Firmware as described at the head of this file; `options` are those of the driver."""

    deadman = DEADMAN

    def __init__(self, node: int, options: PwmOptions) -> None:
        self.counts = Counts()
        self._to = str(node)
        self._options = options
        self._line = bytearray()
        self._is_long = False

    def feed(self, data: bytes) -> list[DriveReading]:
        """Process received bytes; return a reading for every line of two pulses."""
        self.counts.n_bytes += len(data)
        readings = []
        *ended, rest = data.split(b"\r")
        for part in ended:
            self._keep(part)
            reading = None if self._is_long else self._read(bytes(self._line))
            if reading is not None:
                readings.append(reading)
                self.counts.frames += 1
            elif self._is_long or self._line.strip():
                self.counts.damaged += 1
            self._line.clear()
            self._is_long = False
        self._keep(rest)
        return readings

    def encode(self, readings: list[Reading]) -> bytes:
        """Return the report of the board's remote control, which is in neutral."""
        options = self._options
        return b"%d, %d\r\n" % (options.steering_centre, options.throttle_centre)

    def _keep(self, part: bytes) -> None:
        """Add to the line, up to the length of the longest valid one."""
        room = _LONGEST - len(self._line)
        self._is_long = self._is_long or len(part) > room
        self._line += part[:room]

    def _read(self, line: bytes) -> DriveReading | None:
        match = _LINE.fullmatch(line)
        if match is None:
            return None
        turn, throttle = int(match[1]), int(match[2])
        if not all(LEAST_PULSE <= pulse <= MOST_PULSE for pulse in (turn, throttle)):
            return None
        options = self._options
        steering = (turn - options.steering_centre) / options.steering_span * options.max_steering
        centre = options.throttle_centre
        is_forward = (throttle > centre) == (options.forward[0][1] > centre)
        points = options.forward if is_forward else options.reverse
        speed = speed_of(throttle, points, centre)
        return DriveReading(
            UNNAMED, self._to, speed if is_forward else 0.0 - speed, steering, brake=False
        )
