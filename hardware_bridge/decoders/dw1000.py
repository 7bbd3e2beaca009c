r"""Lines of DW1000 boards with the thotro library, such as Makerfabs ESP32-UWB [1].

``from: <HEX short address>\t Range: <metres> m\t RX power: <dBm> dBm``. The line contains neither
sender nor time. Some tags also repeat the ranges once a second, to 0.1 m, as
``{"links":[{"A":"1783","R":"1.2"}]}``: these are read until a line of the first form arrives.

References:
    [1] github.com/thotro/arduino-dw1000, github.com/Makerfabs/Makerfabs-ESP32-UWB.
"""

from __future__ import annotations

import json
import re

from hardware_bridge.decoders.lines import Lines
from hardware_bridge.decoders.plausible import Damaged, decimal, distance, power
from hardware_bridge.readings import UNNAMED, RangeReading, Reading

MARK = "from: "
NUMBER = r"(-?[0-9]+\.[0-9]{2}|-?nan|-?inf|-?ovf)"
RANGE_LINE = re.compile(
    rf"from: (?P<id>[0-9A-F]{{1,4}})\t Range: (?P<m>{NUMBER}) m\t RX power: (?P<dbm>{NUMBER}) dBm"
)
ID = re.compile(r"[0-9A-F]{1,4}")
LINKS_MARK = '{"links":'
MOST_LINKS = 64


class RangeLines:
    """Reader of the lines of one board."""

    def __init__(self) -> None:
        self._has_lines = False

    def read_line(self, line: str) -> list[Reading]:
        """Return the ranges of a line; a line of neither form is a message for people.

        Raises:
            Damaged: The line begins as a range and is invalid.
        """
        # Search the last mark: the end of the previous line may be lost.
        if (at := line.rfind(MARK)) >= 0:
            self._has_lines = True
            return [range_of(line[at:])]
        if (at := line.rfind(LINKS_MARK)) >= 0:
            ranges = links_of(line[at:])
            return [] if self._has_lines else ranges
        return []


def range_of(text: str) -> RangeReading:
    """Return the range of a line that begins with `MARK`."""
    match = RANGE_LINE.fullmatch(text.rstrip())
    if match is None:
        raise Damaged
    measured = distance(decimal(match["m"]))
    if measured is None:
        raise Damaged
    return RangeReading(
        UNNAMED, to=match["id"], distance=measured, rx_power=power(decimal(match["dbm"]))
    )


def links_of(text: str) -> list[Reading]:
    """Return the ranges of a line of links; 0.0 marks a link without a measurement."""
    try:
        links = json.loads(text)["links"]
    except (ValueError, RecursionError):
        raise Damaged from None
    if not isinstance(links, list) or len(links) > MOST_LINKS:
        raise Damaged
    readings: list[Reading] = []
    for link in links:
        if not isinstance(link, dict) or set(link) != {"A", "R"}:
            raise Damaged
        to, text = link["A"], link["R"]
        if not isinstance(to, str) or not isinstance(text, str) or not ID.fullmatch(to):
            raise Damaged
        measured = distance(decimal(text))
        if measured is not None:
            readings.append(RangeReading(UNNAMED, to=to, distance=measured))
    return readings


def dw1000_decoder() -> Lines:
    """Return a decoder for one port."""
    return Lines(RangeLines().read_line)
