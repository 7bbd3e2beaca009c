"""Messages between the deciding process and the supervisor, one datagram each.

Both processes run the same version of this program, so this file alone defines the layout.
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
    """Heartbeat of the deciding process."""

    __repr__ = short_repr

    t: float
    """[s] Time of the heartbeat."""
    t_last_message: F64
    """Time of the last message of each car's node, (car) [s]."""


@dataclass(frozen=True, slots=True)
class Decision:
    """Snapshot with requested commands."""

    picture: Picture
    """Snapshot of one environment."""


@dataclass(frozen=True, slots=True)
class Order:
    """Operator command: ``arm``, ``disarm``, ``stop`` (emergency), ``clear`` or ``quit``."""

    what: str


@dataclass(frozen=True, slots=True)
class Telemetry:
    """Bytes received from a car."""

    car: int
    """Slot of the car."""
    t_ns: int
    data: bytes


@dataclass(frozen=True, slots=True)
class Report:
    """State and output of the gate, arrays over (car)."""

    __repr__ = short_repr

    t: float
    """[s] Time of the last tick."""
    speed: F64
    steering: F64
    cap: F64
    armed: F64
    linked: F64
    reason: F64
    well_for: F64
    """[s] Time without a disarming rule."""
    emergency: bool
    late: float
    """[s] Largest delay of a tick since the last report."""
    missed: int
    """Number of ticks more than 20 ms late since the start."""
    lag: float
    """[s] Latency of the latest decision, from its last input byte to writing its command."""


@dataclass(frozen=True, slots=True)
class Notice:
    """Text for the user."""

    text: str


@dataclass(frozen=True, slots=True)
class Ready:
    """Result of the supervisor's start."""

    problem: str = ""
    """Reason for a failed start; empty if it succeeded."""


Message: TypeAlias = Word | Decision | Order | Telemetry | Report | Notice | Ready
_REPORT = struct.Struct("<dd?qd")
_TELEMETRY = struct.Struct("<Bq")
_TIME = struct.Struct("<d")
ROWS = 7
"""Number of rows of per-car numbers in a report."""


def pack(message: Message) -> bytes:
    """Return the bytes of a message."""
    match message:
        case Word(t, t_last_message):
            return b"W" + _TIME.pack(t) + t_last_message.tobytes()
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
    """Return the message of some bytes.

    Raises:
        ValueError: The bytes are no message of a group of `n_cars` cars.
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
