"""Binary frames: they begin with a fixed byte, tell their length, end with the sum of their bytes.

What looks like the beginning of a frame may be a byte in the middle of one, and the length that
follows may be noise. So every possible beginning is followed at the same time, and of all frames
whose sum is right the one that ends first is taken. A false beginning then holds up nothing: the
good frame behind it is complete first. Which bytes are taken depends on the bytes alone, not on how
they were cut.
"""

from __future__ import annotations

from collections.abc import Callable
from heapq import heappop, heappush

from hardware_bridge.counts import Counts
from hardware_bridge.decoders.plausible import Damaged
from hardware_bridge.readings import Reading


class CheckedFrames:
    """The decoder of such a format.

    Args:
        start: The first byte of every frame.
        head: So many bytes tell how long a frame is.
        length: Those bytes to the length of the frame with its check sum, 0 where no frame begins
            so. It is at least `head` + 1, and at most `MOST_WAITING`.
        read: A frame whose sum is right to readings; empty for one that says nothing to us. It may
            raise `Damaged`, and nothing else.
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
        """Place of the first kept byte in the stream, as all places below."""
        self._seen = 0
        """No frame that is not open begins before this."""
        self._open: list[tuple[int, int]] = []
        """A heap of (end, beginning) of frames that may be."""
        self._refused: list[int] = []
        """Beginnings whose sum was wrong, as long as an open frame may hold them."""

    @property
    def waiting(self) -> int:
        """Bytes of frames that may be and are not complete."""
        return len(self._kept)

    def feed(self, data: bytes) -> list[Reading]:
        """Take bytes as they come and return what they complete, in order."""
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
        """Open every frame that may begin in the bytes that were not looked at."""
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
        """What a frame with the right sum says; what overlaps it was none."""
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
        """Drop bytes before a place: they belong to no frame."""
        self.counts.strange += to - self._from
        self.counts.damaged += sum(begin < to for begin in self._refused)
        self._refused = [begin for begin in self._refused if begin >= to]
        del self._kept[: to - self._from]
        self._from = to
