"""Protocols of decoders (bytes in any pieces to readings) and encoders."""

from __future__ import annotations

from typing import Protocol

from hardware_bridge.counts import Counts
from hardware_bridge.readings import Reading

MOST_WAITING = 4096
"""[bytes] Largest number of bytes that a decoder keeps of an incomplete frame."""


class Decoder(Protocol):
    """Decoder of one port. It uses no clock and no port and never raises, whatever the bytes.

    Invariants: the readings do not depend on how the bytes are split; damaged frames are counted
    and skipped, and the next good frame is read; at most `MOST_WAITING` bytes are kept.
    """

    counts: Counts

    @property
    def waiting(self) -> int:
        """Number of bytes kept of an incomplete frame."""

    def feed(self, data: bytes) -> list[Reading]:
        """Process received bytes and return the readings that they complete, in order."""


class Encoder(Protocol):
    """The device side: readings to the bytes that the device would send."""

    def encode(self, readings: list[Reading]) -> bytes:
        """Return the bytes of one device at one instant; unsupported readings are left out."""
