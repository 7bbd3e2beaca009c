"""Text in lines: line ends, invalid characters and the limit of length."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import TypeAlias

from hardware_bridge.counts import Counts
from hardware_bridge.decoders.plausible import Damaged
from hardware_bridge.readings import Reading

MOST_LINE = 1024
"""[bytes] Longest accepted line: twice the longest line of the known formats."""
LINE_END = re.compile(rb"[\r\n]")
NO_TEXT = re.compile(rb"[^\t -~]")

LineReader: TypeAlias = Callable[[str], list[Reading]]
"""Function from a line, without its end, to readings; empty if the line carries none.

It may raise `Damaged`, and nothing else.
"""


class Lines:
    """Decoder of a line-based format, given the function that reads one line.

    Carriage return or line feed ends a line. Nothing else is awaited, so the line after a damaged
    one is read.
    """

    def __init__(self, read: LineReader, most: int = MOST_LINE) -> None:
        """Create a decoder without bytes.

        Args:
            read: Function from a line to readings.
            most: Longest accepted line [bytes].
        """
        self.counts = Counts()
        self._read, self._most = read, most
        self._line = bytearray()
        self._too_long = False

    @property
    def waiting(self) -> int:
        """Number of bytes of the incomplete line."""
        return len(self._line)

    def feed(self, data: bytes) -> list[Reading]:
        """Process received bytes and return the readings that they complete, in order."""
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
