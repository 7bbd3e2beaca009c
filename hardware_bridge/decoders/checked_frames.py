"""Binary frames with a fixed first byte, a length field and the sum of their bytes at the end.

An apparent first byte may lie in the middle of a frame, and the length that follows may be noise.
Therefore every possible beginning is tracked in parallel, and among frames with a correct sum the
one that ends first is accepted. A false beginning delays nothing: the good frame behind it is
complete first. The accepted bytes do not depend on how the stream was split.
"""

from __future__ import annotations

from collections.abc import Callable
from heapq import heappop, heappush

from hardware_bridge.counts import Counts
from hardware_bridge.decoders.plausible import Damaged
from hardware_bridge.readings import Reading


class CheckedFrames:
    """Decoder of such a format.

    Args:
        start: The first byte of every frame.
        head: Number of bytes needed to determine the length of a frame.
        length: Function from these bytes to the length of the frame including its check sum, 0 if
            no frame begins with them. At least `head` + 1, at most `MOST_WAITING`.
        read: Function from a frame with a correct sum to readings; empty if the frame carries none.
            It may raise `Damaged`, and nothing else.
    """

    def __init__(
        self,
        start: int,
        head: int,
        length: Callable[[bytes], int],
        read: Callable[[bytes], list[Reading]],
    ) -> None:
        self.counts = Counts()
        self._start, self._head, self._length, self._read = start, head, length, read
        self._kept = bytearray()
        self._from = 0
        """Stream position of the first kept byte; all positions below are in the stream, too."""
        self._seen = 0
        """No frame except those in `_open` begins before this position."""
        self._open: list[tuple[int, int]] = []
        """Heap of (end, beginning) of candidate frames."""
        self._refused: list[int] = []
        """Beginnings of frames with a wrong sum, as long as a candidate frame may contain them."""

    @property
    def waiting(self) -> int:
        """Number of bytes kept of incomplete candidate frames."""
        return len(self._kept)

    def feed(self, data: bytes) -> list[Reading]:
        """Process received bytes and return the readings that they complete, in order."""
        self.counts.n_bytes += len(data)
        self._kept += data
        self._find()
        readings: list[Reading] = []
        while self._open and self._open[0][0] <= self._from + len(self._kept):
            end, begin = heappop(self._open)
            frame = bytes(self._kept[begin - self._from : end - self._from])
            if sum(frame[:-1]) & 0xFF != frame[-1]:
                self._refused.append(begin)
            else:
                readings += self._take(frame, begin, end)
        self._release(min((begin for _, begin in self._open), default=self._seen))
        return readings

    def _find(self) -> None:
        """Add every candidate frame that begins in the bytes not searched yet."""
        while True:
            at = self._kept.find(self._start, self._seen - self._from)
            if at < 0:
                self._seen = self._from + len(self._kept)
                return
            self._seen = self._from + at
            if at + self._head > len(self._kept):
                return
            length = self._length(bytes(self._kept[at : at + self._head]))
            if length:
                heappush(self._open, (self._seen + length, self._seen))
            self._seen += 1

    def _take(self, frame: bytes, begin: int, end: int) -> list[Reading]:
        """Return the readings of a frame with a correct sum; drop candidates that overlap it."""
        self._release(begin)
        del self._kept[: end - begin]
        self._from = end
        self._seen = max(self._seen, end)
        self._open = sorted(o for o in self._open if o[1] >= end)
        self._refused = [b for b in self._refused if b >= end]
        try:
            readings = self._read(frame)
        except Damaged:
            self.counts.damaged += 1
            return []
        if readings:
            self.counts.frames += 1
        else:
            self.counts.skipped += 1
        return readings

    def _release(self, to: int) -> None:
        """Drop the bytes before a position: they belong to no frame."""
        self.counts.strange += to - self._from
        self.counts.damaged += sum(begin < to for begin in self._refused)
        self._refused = [begin for begin in self._refused if begin >= to]
        del self._kept[: to - self._from]
        self._from = to
