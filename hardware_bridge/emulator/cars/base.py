"""Protocol of the firmware of an emulated car, as seen at its port."""

from __future__ import annotations

from typing import Protocol

from hardware_bridge.counts import Counts
from hardware_bridge.readings import DriveReading, Reading

DEADMAN = 0.2
"""[s] Emulated cars stop by themselves after this time without a motor command, as the page of
drivers demands; a new VESC has 1 s, the original firmware of the RoboHAT MM1 10 s."""


class CarFirmware(Protocol):
    """Counterpart of a `CarDriver`. Pure: no clock, no port, and it never raises.

    Invariant: it decodes the driver's commands within the resolution of the format.
    """

    counts: Counts
    deadman: float
    """[s] Time without a motor command after which the car stops."""

    def feed(self, data: bytes) -> list[DriveReading]:
        """Process received bytes; return a reading for every command that reaches the motor."""

    def encode(self, readings: list[Reading]) -> bytes:
        """Return the bytes to send for the current `MotionReading` and `StatusReading`."""
