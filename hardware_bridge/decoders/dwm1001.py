"""The ``lec`` stream of the shell of DWM1001 modules with the maker's firmware (PANS) [1].

``DIST,<n>,AN<i>,<id>,<x>,<y>,<z>,<metres>,...[,POS,<x>,<y>,<z>,<quality>]``: distances to anchors
and where these are. Only the distances are read. A distance of 0.00 is a known fault of the
firmware: it was not measured.

At high rates characters get lost and lines run into each other. So all that the line says twice
must agree: the number of anchors with the anchors, their indices with their order; and an anchor
comes once.

References:
    [1] Decawave, DWM1001 firmware API guide 2.2.
"""

from __future__ import annotations

import re

from hardware_bridge.decoders.lines import Lines
from hardware_bridge.decoders.plausible import Damaged, decimal, distance
from hardware_bridge.readings import UNNAMED, RangeReading, Reading

MARK = "DIST,"
PROMPT = "dwm> "
METRES = r"-?[0-9]{1,5}\.[0-9]{2}"
ANCHOR = re.compile(
    rf",AN(?P<index>[0-9]{{1,2}}),(?P<id>[0-9A-F]{{4}}),{METRES},{METRES},{METRES},(?P<m>{METRES})"
)
HEAD = re.compile(r"DIST,(?P<n>[0-9]{1,2})")
POSITION = re.compile(rf"(,POS,{METRES},{METRES},{METRES},(100|[0-9]{{1,2}}))?")


def read_line(line: str) -> list[Reading]:
    """A line to its ranges; lines without distances say nothing to us.

    Raises:
        Damaged: It began with distances and contradicts itself.
    """
    line = line.replace(PROMPT, "").rstrip()
    # The last mark: the end of the line before may be lost.
    at = line.rfind(MARK)
    if at < 0:
        return []
    head = HEAD.match(line, at)
    if head is None:
        raise Damaged
    readings: list[Reading] = []
    seen: set[str] = set()
    at = head.end()
    for index in range(int(head["n"])):
        anchor = ANCHOR.match(line, at)
        if anchor is None or int(anchor["index"]) != index or anchor["id"] in seen:
            raise Damaged
        seen.add(anchor["id"])
        measured = distance(decimal(anchor["m"]))
        if measured is not None:
            readings.append(RangeReading(UNNAMED, to=anchor["id"], distance=measured))
        at = anchor.end()
    if POSITION.fullmatch(line, at) is None:
        raise Damaged
    return readings


def dwm1001_decoder() -> Lines:
    """The decoder of one port."""
    return Lines(read_line)
