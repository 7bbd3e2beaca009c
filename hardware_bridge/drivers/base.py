"""What a car driver is: commands to the bytes of a motor controller, and what it answers."""

from __future__ import annotations

from typing import Protocol

from hardware_bridge.decoders.base import Decoder


class CarDriver(Protocol):
    """One car's controller. Pure: no clock, no port.

    Laws: `neutral` asks for no motion whatever went before; every command stays within what the
    controller was configured for, whatever is asked.
    """

    baud: int
    """[1/s] Of its port by default."""
    gap: float
    """[s] Commands that follow each other faster pile up in the controller; 0 where none do."""
    slowest: float
    """[m/s] Asked for less it stands, one way or the other."""
    answers: bool
    """Whether every command is answered by an `AckReading`."""

    @property
    def sequence(self) -> int:
        """Number of the next command; 0 where commands have none."""

    telemetry: Decoder
    """For what the controller answers: `MotionReading`, `StatusReading`, `AckReading`."""

    def opening(self) -> bytes:
        """What is sent when the port was opened; moves nothing."""

    def drive(self, speed: float, steering: float) -> bytes:
        """Ask for a speed [m/s], forward positive, and a steering angle [rad], left positive.

        Numbers that are not finite are taken for `neutral`.
        """

    def neutral(self) -> bytes:
        """Ask for no motion, brakes on where there are any."""

    def ask(self) -> bytes:
        """Ask for telemetry; empty where it comes by itself or there is none."""
