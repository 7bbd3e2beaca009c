"""``lec`` stream of the shell of DWM1001 modules with the manufacturer's firmware (PANS) [1].

``DIST,<n>,AN<i>,<id>,<x>,<y>,<z>,<metres>,...[,POS,<x>,<y>,<z>,<quality>]``: distances to anchors
and the positions of these. Only the distances are read. A distance of 0.00 is a known firmware
fault and means that nothing was measured.

At high rates characters get lost and lines run into each other. Therefore redundant parts of the
line must agree: the number of anchors with the anchors, their indices with their order; and each
anchor may occur only once.

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
    """Return the ranges of a line; lines without distances have none.

    Raises:
        Damaged: The line begins with distances and contradicts itself.
    """
    line = line.replace(PROMPT, "").rstrip()
    # Search the last mark: the end of the previous line may be lost.
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
    """Return a decoder for one port."""
    return Lines(read_line)
