"""What a decoder is: bytes in any pieces to readings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from hardware_bridge.readings import Reading

MOST_WAITING = 4096
"""[bytes] A decoder keeps no more than this of a frame that does not end."""


@dataclass(slots=True)
class Counts:
    """What a decoder met since it was made."""

    n_bytes: int = 0
    frames: int = 0
    """Frames that were whole and right."""
    skipped: int = 0
    """Frames or lines that were whole and say nothing to us: prompts, other messages."""
    damaged: int = 0
    """Frames or lines that were refused: check sum, length, a number that cannot be."""
    strange: int = 0
    """Bytes between frames that belong to none."""


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
