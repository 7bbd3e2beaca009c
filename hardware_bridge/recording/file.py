"""File of a recorder: created, appended to, and truncated to complete records."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from hardware_bridge.errors import BridgeError
from hardware_bridge.recording.format import (
    HEAD,
    MAGIC,
    VERSION,
    Header,
    Kind,
    Record,
    encode_record,
)
from hardware_bridge.recording.syncer import Syncer


class RecordingFile:
    """Recording file, used by one thread.

    Raises:
        BridgeError: The file exists or cannot be written.
    """

    def __init__(self, path: Path, header: Header, write: Callable[[int, bytes], int]) -> None:
        self._marker = os.urandom(4)
        self._write = write
        self._sequence = 1
        first = Record(Kind.HEADER, 0, header.monotonic_ns, header.encode())
        try:
            data = HEAD.pack(MAGIC, VERSION, 0, self._marker) + encode_record(self._marker, first)
        except ValueError as error:
            raise BridgeError(f"{path}: the header does not fit: {error}") from error
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND | getattr(os, "O_BINARY", 0)
        try:
            self._fd = os.open(path, flags, 0o644)
        except FileExistsError as error:
            raise BridgeError(f"{path}: exists already, a recording needs a new name") from error
        except OSError as error:
            raise BridgeError(f"{path}: cannot be recorded to ({error.strerror})") from error
        n, failure = self._put(data)
        if failure is not None or n < len(data):
            os.close(self._fd)
            path.unlink(missing_ok=True)
            raise BridgeError(f"{path}: cannot be recorded to ({failure})")
        self._syncer = Syncer(self._fd)

    def append(self, records: list[Record]) -> tuple[int, str | None]:
        """Number records and append them, with one write if the system accepts it.

        Returns:
            Number of leading records that are in the file, and the reason if not all are.

        Raises:
            ValueError: A record is invalid, see `format.check_record`.
        """
        parts = [
            encode_record(self._marker, replace(record, sequence=self._sequence + k))
            for k, record in enumerate(records)
        ]
        try:
            start = os.fstat(self._fd).st_size
        except OSError as error:
            return 0, str(error.strerror)
        n_bytes, failure = self._put(b"".join(parts))
        whole, end = 0, 0
        while whole < len(parts) and end + len(parts[whole]) <= n_bytes:
            end += len(parts[whole])
            whole += 1
        self._sequence += whole
        if failure is not None:
            try:
                os.ftruncate(self._fd, start + end)
            except OSError:
                # The content after `end` is unknown, so its numbers must not be reused. A reader
                # skips the torn record.
                self._sequence += len(parts) - whole
        return whole, failure

    @property
    def sync_failure(self) -> str | None:
        """Reason why the disk may lack written data."""
        return self._syncer.failure

    def close(self) -> None:
        """Sync the file to the disk and close it."""
        self._syncer.stop()
        with contextlib.suppress(OSError):
            os.close(self._fd)

    def _put(self, data: bytes) -> tuple[int, str | None]:
        """Write data; return the number of bytes written and the reason if not all were."""
        done = 0
        while done < len(data):
            try:
                n = self._write(self._fd, data[done:] if done else data)
            except OSError as error:
                return done, str(error.strerror or error)
            if n <= 0:
                return done, "the system takes no bytes"
            done += n
        return done, None
