"""Protocol of car drivers: commands to bytes of a motor controller, and decoding of telemetry."""

from __future__ import annotations

from typing import Protocol

from hardware_bridge.decoders.base import Decoder


class CarDriver(Protocol):
    """Driver of one car's controller. Pure: no clock, no port.

    Invariants: `neutral` requests no motion, whatever was sent earlier; every command stays within
    the configured limits, for any input.
    """

    baud: int
    """[1/s] Default baud rate of its port."""
    gap: float
    """[s] Least interval between commands: faster ones queue up in the controller; 0 if none do."""
    slowest: float
    """[m/s] Lowest speed that the car holds in both directions; slower commands may stop it."""
    answers: bool
    """True if every command is acknowledged by an `AckReading`."""

    @property
    def sequence(self) -> int:
        """Number of the next command; 0 if commands are not numbered."""

    telemetry: Decoder
    """Decoder of the controller's `MotionReading`, `StatusReading` and `AckReading`."""

    def opening(self) -> bytes:
        """Return the bytes to send when the port was opened; they cause no motion."""

    def drive(self, speed: float, steering: float) -> bytes:
        """Return the command for a speed [m/s] and a steering angle [rad].

        Forward and left are positive; values that are not finite give `neutral`.
        """

    def neutral(self) -> bytes:
        """Return the command for no motion, with brakes on if there are any."""

    def ask(self) -> bytes:
        """Return the request for telemetry; empty if it is sent unprompted or there is none."""
