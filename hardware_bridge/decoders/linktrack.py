"""Nooploop LinkTrack, distributed ranging (mode DR): Node_Frame3 and Node_Frame2 [1].

Little-endian, ``55 <function> <u16 length> ... <sum>``. Other functions with a correct sum are
skipped; other products of the manufacturer begin with 0x57 and are ignored.

Node_Frame2 holds an IMU sample and an orientation filtered by the node. Only the sample is passed
on: the tracker filters the orientation of all nodes in the same way, from samples with known
errors, and using both would count the same motion twice.

Ids are counted separately for each role. A node of mode DR is named by its number; in the modes
with anchors the letter of the role precedes it, as in the manufacturer's software: anchor 0 is A0,
tag 1 is T1.

References:
    [1] Nooploop, nlink_unpack, github.com/nooploop-dev/nlink_unpack.
"""

from __future__ import annotations

import struct
from math import isfinite

from hardware_bridge.decoders.checked_frames import CheckedFrames
from hardware_bridge.decoders.plausible import MOST_ACCEL, MOST_RATE, Damaged, distance
from hardware_bridge.readings import (
    MILLISECONDS_32,
    ImuReading,
    RangeReading,
    Reading,
    Source,
    StatusReading,
    Vector,
)

START = 0x55
NODE_FRAME_2, NODE_FRAME_3 = 0x04, 0x05
FUNCTIONS = frozenset((0x00, 0x01, 0x02, 0x03, 0x04, 0x05, 0x06, 0x08, 0x09))
MOST_OTHER = 1024
"""[bytes] Longest accepted frame of another function; Anchor_Frame0 has 896."""

FARTHEST = 1000.0
"""[m] Largest range: models with amplifiers reach farther than plain modules."""

HEAD_3 = struct.Struct("<2xH2BI4x4xHB")
NEIGHBOUR_3 = struct.Struct("<2B3s2B")
HEAD_2 = struct.Struct("<2xH2B4x3x9s9s9x6f12x6s4f4xI10xHB")
NEIGHBOUR_2 = struct.Struct("<2B3s2B4x2x")
LAYOUTS = {NODE_FRAME_2: (HEAD_2, NEIGHBOUR_2), NODE_FRAME_3: (HEAD_3, NEIGHBOUR_3)}

ROLES = {0: "", 1: "A", 2: "T", 3: "C"}
"""Letters of the roles node, anchor, tag and console."""


def name_of(role: int, number: int) -> str:
    """Return the name of a device."""
    return f"{ROLES[role]}{number}" if role in ROLES else f"R{role}-{number}"


def frame_length(head: bytes) -> int:
    """Return the length given by the first four bytes; 0 if it does not fit the function."""
    function, length = head[1], head[2] | head[3] << 8
    if function in LAYOUTS:
        fixed, each = (part.size for part in LAYOUTS[function])
        n_neighbours, rest = divmod(length - fixed - 1, each)
        return length if rest == 0 and 0 <= n_neighbours <= 255 else 0
    return length if function in FUNCTIONS and 5 <= length <= MOST_OTHER else 0


def read_frame(frame: bytes) -> list[Reading]:
    """Return the readings of a frame with a correct sum."""
    function = frame[1]
    if function not in LAYOUTS:
        return []
    head, each = LAYOUTS[function]
    fields = head.unpack_from(frame)
    role, number, local_time = fields[1], fields[2], fields[-3]
    if function == NODE_FRAME_3:
        local_time = fields[3]
    voltage, n_neighbours = fields[-2:]
    if len(frame) != head.size + n_neighbours * each.size + 1:
        raise Damaged
    source = Source(device=name_of(role, number), ticks=local_time, clock=MILLISECONDS_32)
    readings: list[Reading] = []
    if function == NODE_FRAME_2:
        readings += imu_of(source, fields[5:11])
    for at in range(head.size, len(frame) - 1, each.size):
        readings += range_of(source, *each.unpack_from(frame, at))
    if voltage:
        readings.append(StatusReading(source, voltage=voltage / 1000.0))
    return readings


def imu_of(source: Source, numbers: tuple[float, ...]) -> list[Reading]:
    """Return gyroscope [rad/s] and accelerometer [m/s2]; nothing for boards without an IMU."""
    if not any(numbers):
        return []
    gyr: Vector = (numbers[0], numbers[1], numbers[2])
    acc: Vector = (numbers[3], numbers[4], numbers[5])
    if not all(map(isfinite, numbers)):
        raise Damaged
    if max(map(abs, gyr)) > MOST_RATE or max(map(abs, acc)) > MOST_ACCEL:
        raise Damaged
    return [ImuReading(source, gyr=gyr, acc=acc)]


def range_of(
    source: Source, role: int, number: int, millimetres: bytes, first_path: int, total: int
) -> list[Reading]:
    """Return the range to one neighbour; nothing if it was not measured."""
    measured = distance(int.from_bytes(millimetres, "little", signed=True) / 1000.0, FARTHEST)
    if measured is None:
        return []
    return [
        RangeReading(
            source,
            to=name_of(role, number),
            distance=measured,
            rx_power=total / -2.0 if total else None,
            fp_power=first_path / -2.0 if first_path else None,
        )
    ]


def linktrack_decoder() -> CheckedFrames:
    """Return a decoder for one port."""
    return CheckedFrames(START, 4, frame_length, read_frame)
