"""Reader of recordings, also torn or damaged ones; it never returns an unwritten record."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

from hardware_bridge.errors import BridgeError
from hardware_bridge.recording.format import (
    HEAD,
    MAGIC,
    MOST_HEADER,
    MOST_PAYLOAD,
    OVERHEAD,
    VERSION,
    Header,
    Kind,
    Record,
    decode_record,
)

_STEP = 1 << 20
"""[bytes] Size of one read."""
_REACH = MOST_PAYLOAD + OVERHEAD
"""[bytes] Size of the longest record except the header."""


@dataclass(frozen=True, slots=True)
class Recording:
    """Result of `read_recording`; iteration reads the records, each time from the file."""

    path: Path
    header: Header
    n_records: int
    """Number of complete records, without the header."""
    torn: bool
    """True if the file ends within a record, as after a killed process or on a full disk."""
    damaged: int
    """Number of places before the end that hold no valid record and were skipped."""
    missing: int
    """Number of records lost in these places, by the sequence numbers."""
    t_range_ns: tuple[int, int]
    """[ns] Earliest and latest time of a record; those of the header if there is none."""
    _start: int
    _end: int
    _marker: bytes

    def event(self, record: Record) -> dict[str, Any]:
        """Return the content of an EVENT.

        Raises:
            BridgeError: The content is invalid.
        """
        try:
            return record.event()
        except ValueError as error:
            raise BridgeError(f"{self.path.name}: a damaged record of an event: {error}") from error

    def __iter__(self) -> Iterator[Record]:
        """Yield complete records in the order of writing."""
        with open(self.path, "rb") as file:
            file.seek(self._start)
            scan = _Scan(file, self._end - self._start, self._marker)
            yield from scan.records()


def read_recording(path: Path | str) -> Recording:
    """Scan a recording once: check and count every record.

    Raises:
        BridgeError: The file is missing, not a recording, or of a later version, or its header is
            damaged.
    """
    path = Path(path)
    try:
        if path.exists() and not path.is_file():
            raise BridgeError(f"{path}: cannot be read (expected a file)")
        with open(path, "rb") as file:
            return _read(path, file)
    except OSError as error:
        raise BridgeError(f"{path}: cannot be read ({error.strerror})") from error


def _read(path: Path, file: BinaryIO) -> Recording:
    head = file.read(HEAD.size + OVERHEAD + MOST_HEADER)
    if not head.startswith(MAGIC):
        raise BridgeError(f"{path}: not a recording, expected a file that `--record` wrote")
    first, version = None, VERSION
    if len(head) >= HEAD.size:
        _, version, _, marker = HEAD.unpack_from(head)
        first = decode_record(head, HEAD.size, marker)
    if version != VERSION:
        advice = "update it" if version > VERSION else "replay it with the software that wrote it"
        raise BridgeError(
            f"{path}: a recording of version {version}, this software reads {VERSION}; {advice}"
        )
    if first is None or first.kind != Kind.HEADER:
        raise BridgeError(f"{path}: the header of the recording is damaged")
    try:
        header = Header.decode(first.payload)
    except (ValueError, RecursionError) as error:
        raise BridgeError(f"{path}: the header of the recording is damaged: {error}") from error
    start = HEAD.size + OVERHEAD + len(first.payload)
    end = os.fstat(file.fileno()).st_size
    file.seek(start)
    scan = _Scan(file, end - start, marker)
    n, t_first, t_last = 0, None, None
    for record in scan.records():
        n += 1
        t_first = record.t_ns if t_first is None else min(t_first, record.t_ns)
        t_last = record.t_ns if t_last is None else max(t_last, record.t_ns)
    t = header.monotonic_ns
    return Recording(
        path=path,
        header=header,
        n_records=n,
        torn=scan.torn,
        damaged=scan.damaged,
        missing=scan.last - n,
        t_range_ns=(t if t_first is None else t_first, t if t_last is None else t_last),
        _start=start,
        _end=end,
        _marker=marker,
    )


class _Scan:
    """One pass over part of a file, in bounded memory."""

    def __init__(self, file: BinaryIO, size: int, marker: bytes) -> None:
        self._file = file
        self._left = size
        self._marker = marker
        self._data = bytearray()
        self._at = 0
        self.last = 0
        """Sequence number of the last record."""
        self.damaged = 0
        self.torn = False

    def records(self) -> Iterator[Record]:
        """Yield complete records with rising numbers, so that a repeated block counts once."""
        while self._fill():
            record = decode_record(self._data, self._at, self._marker)
            # Numbers also fall if an older block of the same file remains.
            if record is not None and record.sequence > self.last and record.kind != Kind.HEADER:
                self.damaged += self.torn
                self.torn = False
                self.last = record.sequence
                self._at += OVERHEAD + len(record.payload)
                yield record
            else:
                self.torn = True
                self._seek_marker()

    def _fill(self) -> bool:
        """Buffer a complete record, as far as the file reaches; return False at its end."""
        if len(self._data) - self._at < _REACH and self._left > 0:
            del self._data[: self._at]
            self._at = 0
            while self._left > 0 and len(self._data) < _STEP:
                data = self._file.read(min(self._left, _STEP))
                self._left = self._left - len(data) if data else 0
                self._data += data
        return self._at < len(self._data)

    def _seek_marker(self) -> None:
        """Move to the next possible start of a record."""
        found = self._data.find(self._marker, self._at + 1)
        if found >= 0:
            self._at = found
        else:
            # The marker may begin in the last bytes and continue in unread ones.
            keep = len(self._marker) - 1 if self._left > 0 else 0
            self._at = max(self._at + 1, len(self._data) - keep)
