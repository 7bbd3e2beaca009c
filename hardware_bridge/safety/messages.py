"""What the deciding process and the supervisor tell each other, one datagram each.

Both run the same version of this program, so the layout is a matter of this file alone.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from hardware_bridge.safety.picture import Picture
from tracking.arrays import F64
from tracking.params.short_repr import short_repr


@dataclass(frozen=True, slots=True)
class Word:
    """A sign of life."""

    __repr__ = short_repr

    t: float
    """[s] When it was given."""
    heard: F64
    """When each car's node was last heard, (car) [s]."""


@dataclass(frozen=True, slots=True)
class Decision:
    """A picture with its wishes."""

    picture: Picture
    """Of one environment."""


@dataclass(frozen=True, slots=True)
class Order:
    """What a person asks for: ``arm``, ``disarm``, ``stop`` (emergency), ``clear`` or ``quit``."""

    what: str


@dataclass(frozen=True, slots=True)
class Telemetry:
    """Bytes that a car sent."""

    car: int
    """Slot."""
    t_ns: int
    data: bytes


@dataclass(frozen=True, slots=True)
class Report:
    """What the gate did, arrays over (car)."""

    __repr__ = short_repr

    t: float
    """[s]"""
    speed: F64
    steering: F64
    cap: F64
    armed: F64
    linked: F64
    reason: F64
    well_for: F64
    """[s]"""
    emergency: bool
    late: float
    """[s] The latest tick since the last report, how late."""
    missed: int
    """Ticks later than 20 ms since the start."""
    lag: float
    """[s] Of the latest decision: from the last byte that it rests on to its command's bytes."""


@dataclass(frozen=True, slots=True)
class Notice:
    """Something that the user should read."""

    text: str


@dataclass(frozen=True, slots=True)
class Ready:
    """The supervisor has its ports and begins, or says why it cannot."""

    problem: str = ""
    """Empty if it begins."""


Message: TypeAlias = Word | Decision | Order | Telemetry | Report | Notice | Ready
_REPORT = struct.Struct("<dd?qd")
_TELEMETRY = struct.Struct("<Bq")
_TIME = struct.Struct("<d")
ROWS = 7
"""Of numbers of every car in a report."""


def pack(message: Message) -> bytes:
    """The bytes of a message."""
    match message:
        case Word(t, heard):
            return b"W" + _TIME.pack(t) + heard.tobytes()
        case Decision(picture):
            return b"D" + picture.to_bytes()
        case Order(what):
            return b"O" + what.encode()
        case Telemetry(car, t_ns, data):
            return b"T" + _TELEMETRY.pack(car, t_ns) + data
        case Report():
            r = message
            rows = (r.speed, r.steering, r.cap, r.armed, r.linked, r.reason, r.well_for)
            head = _REPORT.pack(r.t, r.late, r.emergency, r.missed, r.lag)
            return b"R" + head + np.stack(rows).astype(np.float64).tobytes()
        case Notice(text):
            return b"N" + text.encode()
        case Ready(problem):
            return b"Y" + problem.encode()


def unpack(data: bytes, n_cars: int) -> Message:
    """The message that the bytes are.

    Raises:
        ValueError: They are none of a group of so many cars.
    """
    kind, rest = data[:1], data[1:]
    if kind == b"W":
        return Word(_head(_TIME, rest)[0], _numbers(rest[_TIME.size :], n_cars))
    if kind == b"D":
        return Decision(Picture.from_bytes(rest, n_cars))
    if kind == b"O":
        return Order(rest.decode())
    if kind == b"T":
        car, t_ns = _head(_TELEMETRY, rest)
        return Telemetry(car, t_ns, rest[_TELEMETRY.size :])
    if kind == b"R":
        t, late, emergency, missed, lag = _head(_REPORT, rest)
        rows = _numbers(rest[_REPORT.size :], ROWS * n_cars).reshape(ROWS, n_cars)
        speed, steering, cap, armed, linked, reason, well_for = rows
        return Report(
            t, speed, steering, cap, armed, linked, reason, well_for, emergency, late, missed, lag
        )
    if kind == b"N":
        return Notice(rest.decode())
    if kind == b"Y":
        return Ready(rest.decode())
    raise ValueError(f"unknown kind {kind!r}")


def _head(layout: struct.Struct, data: bytes) -> tuple[Any, ...]:
    if len(data) < layout.size:
        raise ValueError(f"expected at least {layout.size} bytes, got {len(data)}")
    return layout.unpack_from(data)


def _numbers(data: bytes, count: int) -> F64:
    if len(data) != 8 * count:
        raise ValueError(f"expected {count} numbers, got {len(data)} bytes")
    return np.frombuffer(data, dtype=np.float64)
