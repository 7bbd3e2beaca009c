"""Conversion of readings to messages of the wire format, and back."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any, TypeAlias

from hardware_bridge.readings import (
    AckReading,
    DriveReading,
    HeartbeatReading,
    ImuReading,
    MotionReading,
    NearReading,
    OperatorReading,
    PeerReading,
    RangeReading,
    Reading,
    Source,
    StateReading,
    StatusReading,
)
from hardware_bridge.wire import definition as wire
from hardware_bridge.wire.definition import Message

Row: TypeAlias = Sequence[float]
WireMessage: TypeAlias = tuple[Message, tuple[float, ...]]

made: Callable[[type, tuple[Any, ...]], Any] = tuple.__new__
"""Build a reading from all its fields, a third faster than by its class; for frequent types."""
UNIT_WITHIN = 1e-3
"""[-] Largest deviation of the norm of a quaternion from 1."""
NODE_LIMIT = 1 << 16
WORD_LIMIT = 1 << 32


@cache
def name_of(node: float) -> str:
    """Return the name of a node, 0 to 65535, in readings."""
    return str(int(node))


def node_number(name: str, device: str) -> int:
    """Return the node number in a name.

    Raises:
        ValueError: The name is not a decimal number from 0 to 65535 without leading zeros.
    """
    if not (device.isascii() and device.isdecimal() and len(device) <= 5):
        raise ValueError(f"{name}: expected a node, 0 to {NODE_LIMIT - 1}, got {device!r}")
    node = int(device)
    if node >= NODE_LIMIT or str(node) != device:
        raise ValueError(f"{name}: expected a node, 0 to {NODE_LIMIT - 1}, got {device!r}")
    return node


def word(name: str, value: int) -> int:
    """Return a number after checking that it has 32 bits.

    Raises:
        ValueError: The number is out of range.
    """
    if not 0 <= value < WORD_LIMIT:
        raise ValueError(f"{name}: expected 0 to {WORD_LIMIT - 1}, got {value}")
    return value


def is_unit(q: Sequence[float]) -> bool:
    """Return whether four numbers are a unit quaternion."""
    return abs(math.sqrt(sum(x * x for x in q)) - 1.0) <= UNIT_WITHIN


def _of_imu(r: ImuReading) -> WireMessage:
    if r.mag is None:
        return wire.IMU, (*r.gyr, *r.acc)
    return wire.IMU_MAG, (*r.gyr, *r.acc, *r.mag)


def _of_state(r: StateReading) -> WireMessage:
    if not is_unit(r.q_wb):
        raise ValueError(f"q_wb: expected a unit quaternion, got {r.q_wb}")
    return wire.STATE, (*r.q_wb, *r.accel_w)


def _of_peer(r: PeerReading) -> WireMessage:
    if not is_unit(r.q_wb):
        raise ValueError(f"q_wb: expected a unit quaternion, got {r.q_wb}")
    return wire.PEER, (node_number("of", r.of), r.age, *r.q_wb, *r.accel_w, r.noise)


def _of_range(r: RangeReading) -> WireMessage:
    has = (r.nearer is not None) | (r.rx_power is not None) << 1 | (r.fp_power is not None) << 2
    nearer = 0 if r.nearer is None else node_number("nearer", r.nearer)
    to = node_number("to", r.to)
    return wire.RANGES, (to, nearer, r.distance, r.rx_power or 0.0, r.fp_power or 0.0, 0.0, has)


def _of_motion(r: MotionReading) -> WireMessage:
    return wire.MOTION, (r.speed, r.steering or 0.0, r.steering is not None)


def _of_near(r: NearReading) -> WireMessage:
    bearing = math.remainder(r.bearing, 2.0 * math.pi)
    return wire.NEAR, (bearing, r.distance or 0.0, r.distance is not None)


def _of_status(r: StatusReading) -> WireMessage:
    return wire.STATUS, (word("fault", r.fault), r.voltage or 0.0, r.voltage is not None)


def _of_drive(r: DriveReading) -> WireMessage:
    return wire.COMMAND, (node_number("to", r.to), r.speed, r.steering, r.brake)


_OF: dict[type, Callable[[Any], WireMessage]] = {
    ImuReading: _of_imu,
    StateReading: _of_state,
    PeerReading: _of_peer,
    RangeReading: _of_range,
    MotionReading: _of_motion,
    NearReading: _of_near,
    StatusReading: _of_status,
    HeartbeatReading: lambda r: (wire.HEARTBEAT, ()),
    DriveReading: _of_drive,
    OperatorReading: lambda r: (wire.REMOTE, (node_number("to", r.to), *r.velocity)),
    AckReading: lambda r: (wire.ACK, (word("command", r.command),)),
}


def message_of(reading: Reading) -> WireMessage:
    """Return message and values of a reading; for a message with rows, one row.

    Raises:
        ValueError: A value is not finite, a node not a number, or a quaternion not normalised.
    """
    message, values = _OF[type(reading)](reading)
    if not all(map(math.isfinite, values)):
        raise ValueError(f"{type(reading).__name__}: expected finite numbers, got {reading}")
    return message, values


def _as_imu(s: Source, v: Row) -> Reading:
    reading: Reading = made(ImuReading, (s, (v[0], v[1], v[2]), (v[3], v[4], v[5]), None))
    return reading


def _as_imu_mag(s: Source, v: Row) -> Reading:
    reading: Reading = made(
        ImuReading, (s, (v[0], v[1], v[2]), (v[3], v[4], v[5]), (v[6], v[7], v[8]))
    )
    return reading


def _as_state(s: Source, v: Row) -> Reading | None:
    return StateReading(s, (v[0], v[1], v[2], v[3]), (v[4], v[5], v[6])) if is_unit(v[:4]) else None


def _as_peer(s: Source, v: Row) -> Reading | None:
    if not is_unit(v[2:6]):
        return None
    q, accel = (v[2], v[3], v[4], v[5]), (v[6], v[7], v[8])
    return PeerReading(s, name_of(v[0]), v[1], q, accel, v[9])


def _as_range(s: Source, v: Row) -> Reading:
    has = int(v[6])
    rx = v[3] if has & 2 else None
    fp = v[4] if has & 4 else None
    nearer = name_of(v[1]) if has & 1 else None
    reading: Reading = made(RangeReading, (s, name_of(v[0]), v[2], rx, fp, nearer))
    return reading


def _as_motion(s: Source, v: Row) -> Reading:
    return MotionReading(s, v[0], v[1] if int(v[2]) & 1 else None)


def _as_near(s: Source, v: Row) -> Reading:
    return NearReading(s, v[0], v[1] if int(v[2]) & 1 else None)


def _as_status(s: Source, v: Row) -> Reading:
    return StatusReading(s, v[1] if int(v[2]) & 1 else None, int(v[0]))


def _as_drive(s: Source, v: Row) -> Reading:
    return DriveReading(s, name_of(v[0]), v[1], v[2], bool(int(v[3]) & 1))


AS_READING: dict[int, Callable[[Source, Row], Reading | None]] = {
    wire.IMU.type: _as_imu,
    wire.IMU_MAG.type: _as_imu_mag,
    wire.STATE.type: _as_state,
    wire.RANGES.type: _as_range,
    wire.MOTION.type: _as_motion,
    wire.NEAR.type: _as_near,
    wire.PEER.type: _as_peer,
    wire.STATUS.type: _as_status,
    wire.HEARTBEAT.type: lambda s, v: HeartbeatReading(s),
    wire.COMMAND.type: _as_drive,
    wire.REMOTE.type: lambda s, v: OperatorReading(s, name_of(v[0]), (v[1], v[2])),
    wire.ACK.type: lambda s, v: AckReading(s, int(v[0])),
}
"""Functions by type of message from a row of values to a reading, None if invalid."""
