"""Firmware of an emulated VESC: frames to commands, and values on request.

A SERVO frame turns the servo and is no motor command: the next motor command contains the new
steering angle, and SERVO alone does not reset the dead man's switch.
"""

from __future__ import annotations

import struct

from hardware_bridge.counts import Counts
from hardware_bridge.drivers.vesc import VescOptions
from hardware_bridge.drivers.vesc_frames import (
    GET_VALUES,
    SET_CURRENT_BRAKE,
    SET_RPM,
    SET_SERVO,
    FrameReader,
    frame,
)
from hardware_bridge.drivers.vesc_values import VescValues, write_values
from hardware_bridge.emulator.cars.base import DEADMAN
from hardware_bridge.readings import UNNAMED, DriveReading, MotionReading, Reading, StatusReading

_LENGTHS = {GET_VALUES: 1, SET_RPM: 5, SET_CURRENT_BRAKE: 5, SET_SERVO: 3}
_MOST_ASKED = 8
"""Largest number of pending requests."""


class VescFirmware:
    """Firmware as described at the head of this file; `options` are those of the driver."""

    deadman = DEADMAN

    def __init__(self, node: int, options: VescOptions) -> None:
        self.counts = Counts()
        self._to = str(node)
        self._options = options
        self._frames = FrameReader(self.counts)
        self._steering = 0.0
        self._asked = 0
        self._values = VescValues(erpm=0, voltage=0.0, fault=0)

    def feed(self, data: bytes) -> list[DriveReading]:
        """Process received bytes; return a reading for every SET_RPM and SET_CURRENT_BRAKE."""
        readings = []
        for payload in self._frames.feed(data):
            command = payload[0]
            if _LENGTHS.get(command) != len(payload):
                self.counts.skipped += 1
                continue
            self.counts.frames += 1
            if command == SET_SERVO:
                (thousandths,) = struct.unpack(">h", payload[1:])
                position = thousandths / 1e3 - self._options.servo_centre
                self._steering = position / self._options.steering_to_servo
            elif command == GET_VALUES:
                self._asked = min(self._asked + 1, _MOST_ASKED)
            else:
                readings.append(self._command(payload))
        return readings

    def encode(self, readings: list[Reading]) -> bytes:
        """Return an answer to every request since the last call."""
        values = self._values
        erpm, voltage, fault = values.erpm, values.voltage, values.fault
        for reading in readings:
            if isinstance(reading, MotionReading):
                erpm = round(reading.speed * self._options.speed_to_erpm)
            elif isinstance(reading, StatusReading):
                voltage = voltage if reading.voltage is None else reading.voltage
                fault = reading.fault
        self._values = VescValues(erpm=erpm, voltage=voltage, fault=fault)
        asked, self._asked = self._asked, 0
        return asked * frame(write_values(self._values))

    def _command(self, payload: bytes) -> DriveReading:
        if payload[0] == SET_CURRENT_BRAKE:
            return DriveReading(UNNAMED, self._to, 0.0, self._steering, brake=True)
        (erpm,) = struct.unpack(">i", payload[1:])
        speed = erpm / self._options.speed_to_erpm
        return DriveReading(UNNAMED, self._to, speed, self._steering, brake=False)
