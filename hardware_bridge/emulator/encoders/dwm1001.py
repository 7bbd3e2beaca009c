"""Encoder of a DWM1001 with the manufacturer's firmware: a line of distances per instant."""

from __future__ import annotations

import re

from hardware_bridge.emulator.encoders.ticks import moments
from hardware_bridge.readings import RangeReading, Reading

ID = re.compile(r"[0-9A-F]{4}")
MOST_ANCHORS = 4
"""Largest number of anchors that the firmware ranges with at a time."""


class Dwm1001Encoder:
    """A tag in the shell's ``lec`` stream; the format does not include its own id."""

    def __init__(self, device: str) -> None:
        self._device = device

    def encode(self, readings: list[Reading]) -> bytes:
        """Return a line for every four ranges of an instant to anchors with ids of this format."""
        lines = []
        for moment in moments(readings):
            ranges = [r for r in moment if isinstance(r, RangeReading) and ID.fullmatch(r.to)]
            for at in range(0, len(ranges), MOST_ANCHORS):
                lines.append(distances_line(ranges[at : at + MOST_ANCHORS]))
        return "".join(lines).encode()


def distances_line(ranges: list[RangeReading]) -> str:
    """Return the line; anchors have the position of the origin, as if none had been entered."""
    anchors = (f",AN{k},{r.to},0.00,0.00,0.00,{r.distance:.2f}" for k, r in enumerate(ranges))
    return f"DIST,{len(ranges)}{''.join(anchors)}\r\n"
