"""JSON lines of uwb-core and uwb-apps, the open firmware of DWM1001 boards [1].

Forms with a range, of the years 2019 to 2021:

    {"utime": 1, "uid": 39068, "ouid": 4660, "raz": [4.56], "rssi": [-88.5]}
    {"utime": 1, "uid": 39068, "ouid": [4660, 17], "rng": [4.56, 1.20]}
    {"utime": 1, "nrng": {"rng": ["8.088", "8.039"], "uid": ["1946", "5199"]}}
    {"utime": 1, "twr": {"rng": "1.071", "uid": "d22d"}, "uid": "55a6", "diag": {"rssi": "-79.5"}}
    {"utime": 1, "tof": 1101004815, "range": 1036004551}

Ids are numbers or texts in hex; here they are always four capital hex digits. Numbers may be texts;
an integer in place of metres is the bit pattern of a float32, null means not measured. The last
form names no node: its range goes to "", for two boards that know only each other.

A board also prints ranges that others measured and sent to it, so `uid` is an end of the range and
not the sender: it becomes `RangeReading.nearer`, and the port's configuration names the owner of
the clock. `utime` counts microseconds in 32 bits, or the network's time in radio ticks in 64 bits
if the firmware was built with it (``UWB_WCS_ENABLED``, rng_encode.c). The latter exceeds 32 bits
soon after the network's start, which distinguishes the two.

References:
    [1] github.com/Decawave/uwb-core, github.com/Decawave/uwb-apps.
"""

from __future__ import annotations

import json
import re
import struct
from typing import Any

from hardware_bridge.decoders.lines import Lines
from hardware_bridge.decoders.plausible import Damaged, decimal, distance, power
from hardware_bridge.readings import (
    MICROSECONDS_32,
    RADIO_40,
    UNNAMED,
    DeviceClock,
    RangeReading,
    Reading,
    Source,
)

RADIO_64 = DeviceClock(RADIO_40.hz, 1 << 64)
LEAST_RADIO = 10**10
"""Ten digits past 32 bits are damaged microseconds, or the network's first 0.16 s."""
MARK = '{"utime"'
HEX_ID = re.compile(r"[0-9a-fA-F]{1,4}")
DIGITS = re.compile(r"[0-9]{1,10}")


def read_line(line: str) -> list[Reading]:
    """Return the ranges of a line; objects without ranges, banners and prompts have none.

    Raises:
        Damaged: The text is not an object, or has an impossible value.
    """
    # A prompt, or a line whose end was lost, may precede the object.
    at = max(line.rfind(MARK), line.find("{"))
    if at < 0:
        return []
    said = parse(line[at:])
    return [
        RangeReading(source_of(said), to=to, distance=metres, rx_power=dbm, nearer=nearer)
        for nearer, to, metres, dbm in ranges_of(said)
    ]


def parse(text: str) -> dict[str, Any]:
    """Return the object of a text that begins with a brace; a repeated key means merged lines."""
    try:
        said: dict[str, Any] = json.loads(text, object_pairs_hook=without_doubles)
    except (ValueError, RecursionError):
        raise Damaged from None
    return said


def without_doubles(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return the object of these pairs; raise `Damaged` on a repeated key."""
    said = dict(pairs)
    if len(said) != len(pairs):
        raise Damaged
    return said


def source_of(said: dict[str, Any]) -> Source:
    """Return the source with the time of the line."""
    ticks = said.get("utime")
    if ticks is None:
        return UNNAMED
    if type(ticks) is not int or not 0 <= ticks < RADIO_64.modulus:
        raise Damaged
    if ticks < MICROSECONDS_32.modulus:
        return Source(ticks=ticks, clock=MICROSECONDS_32)
    if ticks < LEAST_RADIO:
        raise Damaged
    return Source(ticks=ticks, clock=RADIO_64)


Range = tuple[str | None, str, float, float | None]
"""Nearer end or None, other end, distance [m], power [dBm]."""


def ranges_of(said: dict[str, Any]) -> list[Range]:
    """Return the ranges of an object of any form."""
    own = id_of(said["uid"]) if "uid" in said else None
    if "nrng" in said:
        return many(own, part(said, "nrng").get("uid"), part(said, "nrng").get("rng"))
    if "twr" in said:
        twr = part(said, "twr")
        diag = part(said, "diag") if "diag" in said else {}
        return one(own, twr.get("uid"), twr.get("rng", twr.get("raz")), diag.get("rssi"))
    if "rng" in said:
        return many(own, said.get("ouid"), said["rng"])
    if "raz" in said:
        return one(own, said.get("ouid"), said["raz"], said.get("rssi"))
    if "range" in said and "tof" in said:
        metres = distance(number(said["range"]))
        return [] if metres is None else [(own, "", metres, None)]
    return []


def one(own: str | None, to: Any, metres: Any, dbm: Any) -> list[Range]:
    """Return the range to one other device, with the power if it is given."""
    other = id_of(to)
    if other == own:
        raise Damaged
    measured = distance(number(first(metres)))
    received = power(number(first(dbm)))
    return [] if measured is None else [(own, other, measured, received)]


def many(own: str | None, to: Any, metres: Any) -> list[Range]:
    """Return the ranges to several other devices; nothing if these are not named."""
    if to is None and isinstance(metres, list):
        return []
    if not isinstance(to, list) or not isinstance(metres, list) or len(to) != len(metres):
        raise Damaged
    others = [id_of(each) for each in to]
    if len({own, *others}) != len(others) + 1:
        raise Damaged
    measured = [distance(number(each)) for each in metres]
    return [
        (own, other, m, None) for other, m in zip(others, measured, strict=True) if m is not None
    ]


def part(said: dict[str, Any], key: str) -> dict[str, Any]:
    """Return an object within the object."""
    inner = said[key]
    if not isinstance(inner, dict):
        raise Damaged
    return inner


def first(value: Any) -> Any:
    """Return the first value of a list that also holds angles or further antennas."""
    if not isinstance(value, list):
        return value
    if not 1 <= len(value) <= 3:
        raise Damaged
    return value[0]


def id_of(value: Any) -> str:
    """Return an id as four capital hex digits."""
    if isinstance(value, str) and HEX_ID.fullmatch(value):
        value = int(value, 16)
    if type(value) is not int or not 0 < value < 0xFFFF:  # 0xFFFF is broadcast
        raise Damaged
    return f"{value:04X}"


def number(value: Any) -> float | None:
    """Return a number in any notation; None if nothing was measured."""
    if value is None or isinstance(value, float):
        return value
    if isinstance(value, str):
        if not DIGITS.fullmatch(value):
            return decimal(value)
        value = int(value)
    if type(value) is not int or not 0 <= value < 1 << 32:
        raise Damaged
    bits: float = struct.unpack("<f", struct.pack("<I", value))[0]
    return bits


def uwb_core_decoder() -> Lines:
    """Return a decoder for one port."""
    return Lines(read_line)
