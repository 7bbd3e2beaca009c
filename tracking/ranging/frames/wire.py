"""Bytes of ranging messages; decoding accepts only valid messages.

Every node sends the same layout, little-endian, in an IEEE 802.15.4 data frame:

    offset  bytes  field
    0       2      frame control, 0x8841: data, short addresses, one PAN
    2       1      sequence number of the sender
    3       2      PAN, which separates groups that must not range with each other
    5       2      destination, 0xFFFF: all
    7       2      source: ID of the sender, 0 to 254
    9       1      version (high four bits), 8 if there is a motion, plus the type
    10      1      root: ID of the initiator that the sender follows
    11      1      round, counted by the initiator
    12      1      slot of this message in the round
    13      1      n: number of members of the round
    14      1      part (high four bits), number of parts minus one (low four bits)
    15      1      boot: a random number drawn when the sender was switched on
    16      5      time stamp of this very transmission
    21      7 k    the table: ID 1, receive time stamp 5, quality 1
    21+7k   24     preintegrated motion of the sender, see `motion`, if there is one
    end     2      check sum, CRC-16 of IEEE 802.15.4

The first n - 1 rows of the table are the other members of the round by rising ID; then come other
received nodes. A `JOIN` has no table. A table too long for a frame is split: every part is a
transmission of its own, with its own time stamp; the last one may have a motion. Quality: high four
bits the received power in steps of 3 dB below -60 dBm, 15 if the node was not received since the
sender's last message; low four bits received minus first-path power in dB.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

from tracking.errors import WireError
from tracking.ranging.frames.motion import MOTION_BYTES
from tracking.ranging.frames.timestamps import MODULUS

VERSION = 1
MAX_ID = 254
FIXED_BYTES = 23
ENTRY_BYTES = 7
MAX_PARTS = 16

_HEADER = struct.Struct("<HBHHHBBBBBBB")
_FRAME_CONTROL = 0x8841
_BROADCAST = 0xFFFF
_HAS_MOTION = 8
_NOT_RECEIVED = 15
_POWER_TOP, _POWER_STEP = -60.0, 3.0


class Type(IntEnum):
    """Types of messages."""

    REQUEST = 1
    """Message of an initiator: starts a round and names its members. If the smallest of them is
    another node, `root` is that node, and it sends the next request."""
    REPLY = 2
    """Message of any other member."""
    JOIN = 3
    """Message of a node that is not a member yet; `slot` is that of the next member."""
    ALERT = 4
    """Message of a node that received another one with its own ID."""


@dataclass(frozen=True, slots=True)
class Entry:
    """One row of the table: the reception of a node since the sender's last message."""

    id: int
    stamp: int | None
    """Receive time stamp, in the sender's clock; None without reception."""
    rx_power: float = 0.0
    """Received power [dBm]."""
    fp_power: float = 0.0
    """First-path power [dBm]."""


@dataclass(frozen=True, slots=True)
class Frame:
    """One transmission."""

    type: Type
    src: int
    root: int
    round: int
    slot: int
    n: int
    boot: int
    stamp: int
    entries: tuple[Entry, ...]
    pan: int = 0
    sequence: int = 0
    part: int = 0
    parts: int = 1
    motion: bytes = b""
    """Motion of the sender, see `frames.motion`; empty for none."""


def entries_per_frame(max_frame: int) -> int:
    """Return the number of table rows that fit into a frame of `max_frame` bytes."""
    return (max_frame - FIXED_BYTES) // ENTRY_BYTES


def frame_lengths(n_entries: int, max_frame: int) -> list[int]:
    """Return the bytes of each part of a message with `n_entries` rows."""
    most = entries_per_frame(max_frame)
    parts = max(1, -(-n_entries // most))
    if parts > MAX_PARTS:
        raise WireError(f"table: {n_entries} rows do not fit into {MAX_PARTS} frames")
    rows = [min(most, n_entries - p * most) for p in range(parts)]
    return [FIXED_BYTES + ENTRY_BYTES * r for r in rows]


def split(entries: Sequence[Entry], max_frame: int) -> list[tuple[Entry, ...]]:
    """Return the rows of each part of a message."""
    most, parts = entries_per_frame(max_frame), len(frame_lengths(len(entries), max_frame))
    return [tuple(entries[p * most : (p + 1) * most]) for p in range(parts)]


def encode(frame: Frame) -> bytes:
    """Return the bytes of a frame."""
    body = _HEADER.pack(
        _FRAME_CONTROL,
        frame.sequence,
        frame.pan,
        _BROADCAST,
        frame.src,
        VERSION << 4 | frame.type | (_HAS_MOTION if frame.motion else 0),
        frame.root,
        frame.round,
        frame.slot,
        frame.n,
        frame.part << 4 | frame.parts - 1,
        frame.boot,
    )
    body += frame.stamp.to_bytes(5, "little")
    body += b"".join(
        bytes((e.id,)) + (e.stamp or 0).to_bytes(5, "little") + bytes((_quality(e),))
        for e in frame.entries
    )
    body += frame.motion
    return body + crc16(body).to_bytes(2, "little")


def decode(data: bytes) -> Frame:
    """Return the frame of some bytes.

    Raises:
        WireError: The bytes are invalid; the message names the field.
    """
    rest = (len(data) - FIXED_BYTES) % ENTRY_BYTES
    if len(data) < FIXED_BYTES or rest not in (0, MOTION_BYTES % ENTRY_BYTES):
        raise WireError(
            f"length: expected {FIXED_BYTES} + {ENTRY_BYTES} k bytes, and {MOTION_BYTES} with a "
            f"motion, got {len(data)}"
        )
    if crc16(data[:-2]) != int.from_bytes(data[-2:], "little"):
        raise WireError("check sum: does not fit")
    end = len(data) - 2 - (MOTION_BYTES if data[9] & _HAS_MOTION else 0)
    if end + 2 < FIXED_BYTES or (end + 2 - FIXED_BYTES) % ENTRY_BYTES:
        raise WireError(f"length: {len(data)} bytes do not fit the flag of a motion")
    control, sequence, pan, to, src, kind, root, round_, slot, n, part, boot = _HEADER.unpack(
        data[: _HEADER.size]
    )
    if control != _FRAME_CONTROL or to != _BROADCAST:
        raise WireError("frame control: not a broadcast of ours")
    if kind >> 4 != VERSION:
        raise WireError(f"version: expected {VERSION}, got {kind >> 4}")
    kind &= 7
    if kind not in Type._value2member_map_:
        raise WireError(f"type: unknown, {kind}")
    if src > MAX_ID or root > MAX_ID:
        raise WireError(f"source, root: expected IDs up to {MAX_ID}, got {src}, {root}")
    if root > src and kind in (Type.REQUEST, Type.REPLY):
        raise WireError(f"root: expected at most the source {src}, got {root}")
    part, parts = part >> 4, (part & 15) + 1
    if part >= parts:
        raise WireError(f"part: expected less than {parts}, got {part}")
    if n < 1 or slot > n:
        raise WireError(f"slot: expected at most n = {n}, got {slot}")
    entries = tuple(
        _entry(data[at : at + ENTRY_BYTES]) for at in range(FIXED_BYTES - 2, end, ENTRY_BYTES)
    )
    ids = [e.id for e in entries]
    if len(set(ids)) < len(ids) or src in ids:
        raise WireError("table: a duplicate ID")
    stamp = int.from_bytes(data[16:21], "little")
    return Frame(
        Type(kind), src, root, round_, slot, n, boot, stamp, entries, pan, sequence,
        part, parts, data[end:-2],
    )  # fmt: skip


def _quality(entry: Entry) -> int:
    if entry.stamp is None:
        return _NOT_RECEIVED << 4
    rx, fp = entry.rx_power, entry.fp_power
    if not (math.isfinite(rx) and math.isfinite(fp)):
        return _NOT_RECEIVED - 1 << 4 | 15  # an empty register of the radio: weakest power
    step = min(max(round((_POWER_TOP - rx) / _POWER_STEP), 0), _NOT_RECEIVED - 1)
    return step << 4 | min(max(round(rx - fp), 0), 15)


def _entry(row: bytes) -> Entry:
    step, gap = row[6] >> 4, row[6] & 15
    if row[0] > MAX_ID:
        raise WireError(f"table: expected IDs up to {MAX_ID}, got {row[0]}")
    stamp = int.from_bytes(row[1:6], "little")
    if step == _NOT_RECEIVED:
        if gap or stamp:
            raise WireError("table: a node that was not received has a stamp")
        return Entry(row[0], None)
    rx = _POWER_TOP - _POWER_STEP * step
    return Entry(row[0], stamp % MODULUS, rx, rx - gap)


def _crc_row(byte: int) -> int:
    for _ in range(8):
        byte = byte >> 1 ^ (0x8408 if byte & 1 else 0)
    return byte


_CRC = tuple(_crc_row(byte) for byte in range(256))


def crc16(data: bytes) -> int:
    """Return the check sum of IEEE 802.15.4, which radios add and check: x^16+x^12+x^5+1."""
    crc = 0
    for byte in data:
        crc = crc >> 8 ^ _CRC[(crc ^ byte) & 0xFF]
    return crc
