"""Which sequence numbers of a stream were seen: a sliding window, modulo 2^32.

The window of the anti-replay service of IPsec [1]: the highest number seen, and a bit for each of
the `WIDTH` numbers up to it.

References:
    [1] Kent, RFC 4303 IP Encapsulating Security Payload, section 3.4.3.
"""

from __future__ import annotations

from enum import Enum

MODULUS = 1 << 32
WIDTH = 1024
"""[-] Ten seconds of a stream at 100 Hz."""

_MASK = (1 << WIDTH) - 1


class Place(Enum):
    """Where a number is, seen from the window."""

    AHEAD = "ahead"
    """Higher than all seen."""
    NEW = "new"
    """Lower than the highest, not seen."""
    SEEN = "seen"
    OLD = "old"
    """Below the window: whether it was seen is not known."""


class SequenceWindow:
    """The numbers seen of one stream."""

    highest: int

    def __init__(self, first: int, *, endless: bool, before: bool = True) -> None:
        """A window whose highest number was seen.

        Args:
            first: That number.
            endless: The numbers go on at 0 after 2^32 - 1. Else what is lower is older, for good.
            before: Whether numbers below the first may still come.
        """
        self.highest = first % MODULUS
        self._endless = endless
        self._seen = 1 if before else _MASK

    def place(self, sequence: int) -> Place:
        """Where a number is; changes nothing."""
        back = self._back(sequence)
        if back < 0:
            return Place.AHEAD
        if back >= WIDTH:
            return Place.OLD
        return Place.SEEN if self._seen >> back & 1 else Place.NEW

    def take(self, sequence: int) -> None:
        """A number was seen; one below the window changes nothing."""
        back = self._back(sequence)
        if back < 0:
            self._seen = (self._seen << min(-back, WIDTH) | 1) & _MASK
            self.highest = sequence % MODULUS
        elif back < WIDTH:
            self._seen |= 1 << back

    def _back(self, sequence: int) -> int:
        """How far a number is below the highest; negative if it is higher."""
        back = self.highest - sequence % MODULUS
        if self._endless:
            half = MODULUS // 2
            back = (back + half) % MODULUS - half
        return back
