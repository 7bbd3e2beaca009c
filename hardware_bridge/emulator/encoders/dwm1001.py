"""The end of a DWM1001 with the maker's firmware: a line of distances a moment."""

from __future__ import annotations

import re

from hardware_bridge.emulator.encoders.ticks import moments
from hardware_bridge.readings import RangeReading, Reading

ID = re.compile(r"[0-9A-F]{4}")
MOST_ANCHORS = 4
"""The firmware ranges with so many at a time."""


class Dwm1001Encoder:
    """A tag in the shell's ``lec`` stream; its own name goes nowhere."""

    def __init__(self, device: str) -> None:
        self._device = device

    def encode(self, readings: list[Reading]) -> bytes:
        """A line for every four ranges of a moment to anchors with ids of this format."""
        lines = []
        for moment in moments(readings):
            ranges = [r for r in moment if isinstance(r, RangeReading) and ID.fullmatch(r.to)]
            for at in range(0, len(ranges), MOST_ANCHORS):
                lines.append(distances_line(ranges[at : at + MOST_ANCHORS]))
        return "".join(lines).encode()


def distances_line(ranges: list[RangeReading]) -> str:
    """The line; anchors whose position was not entered stand at the origin."""
    anchors = (f",AN{k},{r.to},0.00,0.00,0.00,{r.distance:.2f}" for k, r in enumerate(ranges))
    return f"DIST,{len(ranges)}{''.join(anchors)}\r\n"
