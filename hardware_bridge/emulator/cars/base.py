"""What the firmware of a car does, as far as a port shows it."""

from __future__ import annotations

from typing import Protocol

from hardware_bridge.counts import Counts
from hardware_bridge.readings import DriveReading, Reading

DEADMAN = 0.2
"""[s] Emulated cars stop by themselves so long after the last command for the motor. What the page
of drivers asks to set; a new VESC has 1 s, the firmware that comes for the RoboHAT MM1 10 s."""


class CarFirmware(Protocol):
    """The other end of a `CarDriver`. Pure: no clock, no port, and it never raises.

    Law: what a driver says is what its firmware reads, within the resolution of the format.
    """

    counts: Counts
    deadman: float
    """[s] Without a command for the motor it stops after so long."""

    def feed(self, data: bytes) -> list[DriveReading]:
        """Take bytes as they come; one reading for every command that reaches the motor."""

    def encode(self, readings: list[Reading]) -> bytes:
        """What it sends now, of the `MotionReading` and `StatusReading` of this moment."""
