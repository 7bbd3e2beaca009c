"""Our own firmware on a car: commands in the wire format, each acknowledged."""

from __future__ import annotations

from hardware_bridge.decoders.relpos import RelposDecoder
from hardware_bridge.drivers.relpos import RelposOptions
from hardware_bridge.emulator.cars.base import DEADMAN
from hardware_bridge.readings import AckReading, DriveReading, Reading
from hardware_bridge.wire.definition import HOST
from hardware_bridge.wire.encoder import RelposEncoder

MOST_ACKS = 64
"""Largest number of pending acknowledgements."""


class RelposFirmware:
    """Firmware as described at the head of this file; `options` are those of the driver.

    Invariant: a command is executed at most once. Within a boot of the host only rising numbers are
    accepted; with a key also only rising boots, so that a recorded command never moves the car.
    """

    deadman = DEADMAN

    def __init__(self, node: int, options: RelposOptions, key: bytes | None, boot: int) -> None:
        """Start the firmware.

        Args:
            node: The node that the car carries.
            options: Limits of the commands.
            key: Key of the MAC, or None.
            boot: Boot number of this start of the car.
        """
        self._to, self._options, self._keyed = str(node), options, key is not None
        self._decoder = RelposDecoder(key)
        self.counts = self._decoder.counts
        self._encoder = RelposEncoder(node, boot, key)
        self._last: tuple[int, int] | None = None
        self._acks: list[int] = []

    def feed(self, data: bytes) -> list[DriveReading]:
        """Process received bytes; return a reading for every new command to this car."""
        taken = []
        for reading in self._decoder.feed(data):
            if not isinstance(reading, DriveReading) or reading.to != self._to:
                continue
            source = reading.source
            if source.device != str(HOST) or source.boot is None or source.sequence is None:
                continue
            number = (source.boot, source.sequence)
            if not self._is_new(number):
                continue
            self._last = number
            self._acks = [*self._acks[1 - MOST_ACKS :], source.sequence]
            taken.append(self._within(reading))
        return taken

    def encode(self, readings: list[Reading]) -> bytes:
        """Return the bytes of the readings, and of an acknowledgement of every pending command."""
        said = list(readings)
        if readings:
            said += [AckReading(readings[0].source, command) for command in self._acks]
            self._acks.clear()
        return self._encoder.encode(said)

    def _is_new(self, number: tuple[int, int]) -> bool:
        if self._last is None or number > self._last:
            return True
        return not self._keyed and number[0] != self._last[0]

    def _within(self, reading: DriveReading) -> DriveReading:
        fastest, most = self._options.max_speed, self._options.max_steering
        return DriveReading(
            reading.source,
            reading.to,
            min(max(reading.speed, -fastest), fastest),
            min(max(reading.steering, -most), most),
            reading.brake,
        )
