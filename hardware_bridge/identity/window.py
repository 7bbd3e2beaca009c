"""Sliding window of received sequence numbers of a stream, modulo 2^32.

As in the anti-replay service of IPsec [1]: the highest received number, and a bit for each of the
`WIDTH` numbers up to it.

References:
    [1] Kent, RFC 4303 IP Encapsulating Security Payload, section 3.4.3.
"""

from __future__ import annotations

from enum import Enum

MODULUS = 1 << 32
WIDTH = 1024
"""[-] Width of the window: ten seconds of a stream at 100 Hz."""

_MASK = (1 << WIDTH) - 1


class Place(Enum):
    """Place of a number relative to the window."""

    AHEAD = "ahead"
    """Higher than all received ones."""
    NEW = "new"
    """Lower than the highest, not received."""
    SEEN = "seen"
    OLD = "old"
    """Below the window: unknown whether it was received."""


class SequenceWindow:
    """Received numbers of one stream."""

    highest: int

    def __init__(self, first: int, *, endless: bool, before: bool = True) -> None:
        """Create a window whose highest number was received.

        Args:
            first: The highest number.
            endless: True if 0 follows 2^32 - 1; else lower numbers are always older.
            before: True if numbers below the first may still arrive.
        """
        self.highest = first % MODULUS
        self._endless = endless
        self._seen = 1 if before else _MASK

    def place(self, sequence: int) -> Place:
        """Return the place of a number without storing it."""
        back = self._back(sequence)
        if back < 0:
            return Place.AHEAD
        if back >= WIDTH:
            return Place.OLD
        return Place.SEEN if self._seen >> back & 1 else Place.NEW

    def take(self, sequence: int) -> None:
        """Store a number as received; one below the window has no effect."""
        back = self._back(sequence)
        if back < 0:
            self._seen = (self._seen << min(-back, WIDTH) | 1) & _MASK
            self.highest = sequence % MODULUS
        elif back < WIDTH:
            self._seen |= 1 << back

    def _back(self, sequence: int) -> int:
        """Return the distance of a number below the highest; negative if it is higher."""
        back = self.highest - sequence % MODULUS
        if self._endless:
            half = MODULUS // 2
            back = (back + half) % MODULUS - half
        return back
