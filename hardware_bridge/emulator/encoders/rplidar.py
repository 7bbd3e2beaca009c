"""Encoder of an RPLidar in a standard scan: five bytes per sample."""

from __future__ import annotations

from math import pi

from hardware_bridge.decoders.rplidar import ANGLE_UNIT, DISTANCE_UNIT, SAMPLE, TURN
from hardware_bridge.readings import Reading, ScanReading

QUALITY = 47
"""[-] Quality of a good reflection."""
MOST = 0xFFFF


class RplidarEncoder:
    """A scanner; the format does not include its own id."""

    def __init__(self, device: str) -> None:
        self._device = device
        self._last = TURN

    def encode(self, readings: list[Reading]) -> bytes:
        """Return a sample for each reading, in the given order."""
        return b"".join(self._sample(r) for r in readings if isinstance(r, ScanReading))

    def _sample(self, reading: ScanReading) -> bytes:
        angle = round(-reading.bearing % (2.0 * pi) / ANGLE_UNIT) % TURN
        starts = angle < self._last  # a new revolution
        self._last = angle
        metres = 0 if reading.distance is None else round(reading.distance / DISTANCE_UNIT)
        head = QUALITY << 2 | (1 if starts else 2)
        return SAMPLE.pack(head, angle << 1 | 1, min(metres, MOST))
