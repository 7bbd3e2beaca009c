"""Byte format of a recording: a head of 16 bytes, a header record, records.

Every record starts with the file's random marker and ends with a check sum over all preceding
bytes, marker included. A reader thus finds the next complete record behind a damaged place, and
mistakes no part of a payload or of another recording for a record (`docs/how-to/recording.md`).
"""

from __future__ import annotations

import json
import struct
import zlib
from dataclasses import asdict, dataclass
from enum import IntEnum
from typing import Any

MAGIC = b"\x89RELPOS\n"
"""Magic bytes; a byte above 127 and a line end reveal a transfer in text mode."""
VERSION = 2
HEAD = struct.Struct("<8sHH4s")
"""Magic, version, 0, marker."""
PREFIX = struct.Struct("<4sBHQqI")
"""Marker, kind, link, sequence number, time [ns], length of the payload [bytes]."""
CHECK = struct.Struct("<I")
"""CRC-32 of prefix and payload, as zlib computes it."""
OVERHEAD = PREFIX.size + CHECK.size
"""[bytes] Size of a record in addition to its payload."""
MOST_PAYLOAD = 1 << 16
"""[bytes] Largest payload of one record; far more than a port delivers at once."""
MOST_HEADER = 1 << 20
"""[bytes] Largest payload of the header record, which holds a configuration."""


class Kind(IntEnum):
    """Kind of a record. None is 0, so that zeros on a disk are no record."""

    HEADER = 1
    """`Header` as JSON; the first record and no other."""
    BYTES_IN = 2
    """Bytes of one read from a link."""
    TICK = 3
    """A control step: the tracker was asked for an estimate at this time. No payload."""
    EVENT = 4
    """A JSON object with the field ``event``: a notice, commands passed by the gate, or lost
    records."""


@dataclass(frozen=True, slots=True)
class Record:
    """One recorded event."""

    kind: Kind
    link: int
    """Index into `Header.links`; 0 for kinds without a link."""
    t_ns: int
    """Time by the host's monotonic clock [ns]."""
    payload: bytes
    sequence: int = 0
    """Number of the record in the file, without gaps; the header is 0."""

    def event(self) -> dict[str, Any]:
        """Return the payload of an EVENT.

        Raises:
            ValueError: The payload is not JSON, so this is no EVENT.
        """
        try:
            value = json.loads(self.payload)
        except RecursionError as error:
            raise ValueError("nested too deeply") from error
        return value if isinstance(value, dict) else {}


LATEST = 1 << 62
"""[ns] Largest accepted time."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Header:
    """Metadata of a recording."""

    software: str
    """Name and version of the recording software."""
    config: str
    """Text of swarm.toml."""
    links: tuple[str, ...]
    """Names of all links and cars, ``links.left`` or ``cars.1``; records hold their indices."""
    monotonic_ns: int
    """[ns] Time of the host's monotonic clock at the start."""
    wall_ns: int
    """[ns] UTC since 1970 at the same moment, 0 s of the measurements and estimates: for display
    and exports, never for tracking."""

    def encode(self) -> bytes:
        """Return the payload of the header record."""
        return json.dumps(asdict(self)).encode()

    @classmethod
    def decode(cls, payload: bytes) -> Header:
        """Return the header in a payload.

        Raises:
            ValueError: The payload is not a header.
        """
        raw = json.loads(payload)
        if not isinstance(raw, dict):
            raise ValueError("not a table")
        links = raw.get("links")
        if not isinstance(links, list) or not all(isinstance(name, str) for name in links):
            raise ValueError("links: expected names")
        text, numbers = ("software", "config"), ("monotonic_ns", "wall_ns")
        for names, kind in ((text, str), (numbers, int)):
            for name in names:
                if type(raw.get(name)) is not kind:
                    raise ValueError(f"{name}: expected {kind.__name__}")
        for name in numbers:
            if abs(raw[name]) > LATEST:
                raise ValueError(f"{name}: expected nanoseconds, up to 2^62")
        fields = {name: raw[name] for name in (*text, *numbers)}
        return cls(links=tuple(links), **fields)


def check_record(record: Record) -> None:
    """Check that a record can be written.

    Raises:
        ValueError: A number does not fit its field, or the payload is too long.
    """
    _prefix(b"", record)


def encode_record(marker: bytes, record: Record) -> bytes:
    """Return the bytes of a record in the file with that marker.

    Raises:
        ValueError: The record is invalid, see `check_record`.
    """
    body = _prefix(marker, record) + record.payload
    return body + CHECK.pack(zlib.crc32(body))


def _prefix(marker: bytes, record: Record) -> bytes:
    kind, n = Kind(record.kind), len(record.payload)
    if n > most_payload(kind):
        raise ValueError(f"payload: expected at most {most_payload(kind)} bytes, got {n}")
    try:
        return PREFIX.pack(marker, kind, record.link, record.sequence, record.t_ns, n)
    except struct.error as error:
        raise ValueError(f"link, sequence or t_ns: {error}") from error


def decode_record(data: bytes | bytearray, at: int, marker: bytes) -> Record | None:
    """Return the record that starts at `at`, or None without a complete and valid one."""
    size = record_size(data, at, marker)
    if size is None or at + size > len(data):
        return None
    end = at + size - CHECK.size
    if CHECK.unpack_from(data, end)[0] != zlib.crc32(memoryview(data)[at:end]):
        return None
    _, kind, link, sequence, t_ns, _ = PREFIX.unpack_from(data, at)
    payload = bytes(memoryview(data)[at + PREFIX.size : end])
    return Record(Kind(kind), link, t_ns, payload, sequence)


def record_size(data: bytes | bytearray, at: int, marker: bytes) -> int | None:
    """Return the size [bytes] of the record at `at` by its prefix, None without one."""
    if at + PREFIX.size > len(data):
        return None
    found, kind, _, _, _, length = PREFIX.unpack_from(data, at)
    if found != marker or kind not in _KINDS or length > most_payload(kind):
        return None
    return OVERHEAD + int(length)


def most_payload(kind: int) -> int:
    """Return the largest payload of a kind [bytes]."""
    return MOST_HEADER if kind == Kind.HEADER else MOST_PAYLOAD


_KINDS = frozenset(int(kind) for kind in Kind)
