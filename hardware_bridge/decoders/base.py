"""What a decoder is: bytes in any pieces to readings."""

from __future__ import annotations

from typing import Protocol

from hardware_bridge.counts import Counts
from hardware_bridge.readings import Reading

MOST_WAITING = 4096
"""[bytes] A decoder keeps no more than this of a frame that does not end."""


class Decoder(Protocol):
    """Pure: no clock, no port, and it never raises, whatever the bytes are.

    Laws: any cut of the same bytes gives the same readings; what is damaged is counted and
    skipped, and the next good frame is read; no more than `MOST_WAITING` bytes are kept.
    """

    counts: Counts

    @property
    def waiting(self) -> int:
        """Bytes kept of a frame that is not complete."""

    def feed(self, data: bytes) -> list[Reading]:
        """Take bytes as they come and return what they complete, in order."""


class Encoder(Protocol):
    """The device's end: readings to the bytes that it would send."""

    def encode(self, readings: list[Reading]) -> bytes:
        """Bytes of one moment of one device; what the format cannot say is left out."""
