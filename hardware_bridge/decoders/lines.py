"""Text that comes in lines: where they end, what is no text, and when to give one up."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import TypeAlias

from hardware_bridge.counts import Counts
from hardware_bridge.decoders.plausible import Damaged
from hardware_bridge.readings import Reading

MOST_LINE = 1024
"""[bytes] Twice the longest line of the formats that are known."""
LINE_END = re.compile(rb"[\r\n]")
NO_TEXT = re.compile(rb"[^\t -~]")

LineReader: TypeAlias = Callable[[str], list[Reading]]
"""A line, without its end, to readings; empty for a line that says nothing to us.

It may raise `Damaged`, and nothing else.
"""


class Lines:
    """The decoder of a format in lines, made of the function that reads one.

    Either of carriage return and line feed ends a line. Since that is all that is waited for, the
    line after a damaged one is read.
    """

    def __init__(self, read: LineReader, most: int = MOST_LINE) -> None:
        """Begin with nothing read.

        Args:
            read: A line to readings.
            most: Longer lines are given up [bytes].
        """
        self.counts = Counts()
        self._read, self._most = read, most
        self._line = bytearray()
        self._too_long = False

    @property
    def waiting(self) -> int:
        """Bytes of the line that has not ended."""
        return len(self._line)

    def feed(self, data: bytes) -> list[Reading]:
        """Take bytes as they come and return what they complete, in order."""
        self.counts.n_bytes += len(data)
        readings: list[Reading] = []
        *ended, rest = LINE_END.split(data)
        for piece in ended:
            self._add(piece)
            readings += self._end()
        self._add(rest)
        return readings

    def _add(self, piece: bytes) -> None:
        if not self._too_long:
            self._line += piece
            if len(self._line) <= self._most:
                return
            piece = bytes(self._line)
            self._line.clear()
            self._too_long = True
        self.counts.strange += len(piece)

    def _end(self) -> list[Reading]:
        line = bytes(self._line)
        self._line.clear()
        if self._too_long:
            self._too_long = False
            return []
        if not line.strip():
            return []
        try:
            if NO_TEXT.search(line):
                raise Damaged
            readings = self._read(line.decode("ascii"))
        except Damaged:
            self.counts.damaged += 1
            return []
        if readings:
            self.counts.frames += 1
        else:
            self.counts.skipped += 1
        return readings
