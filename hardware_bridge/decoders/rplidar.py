"""Slamtec RPLidar and compatible scanners, standard scan: five bytes per sample [1].

    quality << 2 | not start << 1 | start, angle << 1 | 1, angle >> 7, distance low, distance high

The angle is in 1/64 degree, clockwise from the scanner's front; the distance is in quarters of a
millimetre, and 0 is a direction without a measurement, which carries no information.

There is no check sum. Therefore samples are accepted once `LOCK` of them follow each other: the two
start bits differ, the third bit is set, and the angle advances as in a rotation. A scanner corrects
each angle for its parallax, so neighbours may also go back a little.

References:
    [1] Slamtec, RPLIDAR Interface Protocol and Application Notes, v2.2, section 4, "SCAN" and
        section 5, "MOTOR_PWM".
"""

from __future__ import annotations

import struct
from math import pi

from hardware_bridge.counts import Counts
from hardware_bridge.readings import Reading, ScanReading, Source

SAMPLE = struct.Struct("<BHH")
ANGLE_UNIT = pi / 180.0 / 64.0
"""[rad] Unit of the angle."""
TURN = 360 * 64
"""[1/64 deg] One revolution."""
DISTANCE_UNIT = 0.00025
"""[m] Unit of the distance."""
LOCK = 8
"""[-] Number of consecutive samples that fixes the sample boundaries."""
FARTHEST_STEP, FARTHEST_BACK = 20 * 64, 10 * 64
"""[1/64 deg] Largest steps between two samples: forward (a slow scanner that turns fast makes 5
deg) and backward, by the parallax of a near point."""
LEAST_TURN = 32
"""[1/64 deg] Smallest rotation over `LOCK` samples; the densest scanner makes 0.8 deg."""
WATCH = 8 * LOCK
"""[-] Samples over which the rotation is checked once locked: parallax may reverse a part."""
REQUEST = bytes.fromhex("a5f0029402c1 a520")
"""Start the motor, if the adapter controls it, and scan; other adapters ignore the first part."""


class RplidarDecoder:
    """Decoder of one port."""

    def __init__(self) -> None:
        self.counts = Counts()
        self._kept = bytearray()
        self._run: list[Reading | None] = []
        """Readings of consecutive samples not accepted yet; None for one without a distance."""
        self._n_run = 0
        """Number of consecutive samples, `LOCK` once they are accepted."""
        self._angle = self._turned = self._watched = 0
        """Last angle, rotation over the samples under check [1/64 deg], number of these samples."""

    @property
    def waiting(self) -> int:
        """Number of bytes of samples that are not accepted yet."""
        return len(self._kept)

    def feed(self, data: bytes) -> list[Reading]:
        """Process received bytes and return the readings that they complete, in order."""
        self.counts.n_bytes += len(data)
        kept, source = self._kept, Source()
        kept += data
        readings: list[Reading] = []
        begin, at = 0, self._n_unconfirmed * SAMPLE.size
        while at + SAMPLE.size <= len(kept):
            head, angle, distance = SAMPLE.unpack_from(kept, at)
            if self._follows(head, angle):
                at += SAMPLE.size
                reading = None
                if distance:
                    bearing = -(angle >> 1) * ANGLE_UNIT
                    reading = ScanReading(source, bearing, distance * DISTANCE_UNIT)
                self._run.append(reading)
                if self._n_run < LOCK:
                    continue
                begin = at
                self._release(readings)
            elif self._n_run:
                # An accepted sample is consumed; otherwise any byte may begin the first sample.
                at = begin if self._n_run == LOCK else begin + 1
                self.counts.strange += at - begin
                begin = at
                self._n_run = 0
                self._run.clear()
            else:
                begin = at = at + 1
                self.counts.strange += 1
        del kept[:begin]
        return readings

    @property
    def _n_unconfirmed(self) -> int:
        return 0 if self._n_run == LOCK else self._n_run

    def _follows(self, head: int, angle: int) -> bool:
        """Add a sample to the run if it is valid and can follow the previous one."""
        if (head ^ head >> 1) & angle & 1 == 0 or angle >> 1 >= TURN:
            return False
        angle >>= 1
        step = (angle - self._angle + TURN // 2) % TURN - TURN // 2
        if self._n_run == 0:
            step = self._turned = self._watched = 0
        self._watched += 1
        turned = self._turned + step
        locked = self._n_run == LOCK
        if not -FARTHEST_BACK <= step <= FARTHEST_STEP:
            return False
        if self._watched == (WATCH if locked else LOCK):
            if turned < LEAST_TURN * self._watched // LOCK:
                return False
            turned = self._watched = 0
        self._angle, self._turned = angle, turned
        self._n_run = min(self._n_run + 1, LOCK)
        return True

    def _release(self, readings: list[Reading]) -> None:
        measured = [reading for reading in self._run if reading is not None]
        self.counts.frames += len(self._run)
        readings += measured
        self._run.clear()
