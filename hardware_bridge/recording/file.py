"""The file under a recorder: opened new, only appended to, cut back to whole records."""

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
    """Used by one thread.

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
        """Number records and write them at the end, with one write if the system takes it.

        Returns:
            How many of them, from the first, are in the file, and why not all.

        Raises:
            ValueError: One of them is none, see `format.check_record`.
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
                # What stands there now is unknown, so its numbers must not come again. A
                # reader finds its way over the torn record.
                self._sequence += len(parts) - whole
        return whole, failure

    @property
    def sync_failure(self) -> str | None:
        """Why the disk may lack some of what was written."""
        return self._syncer.failure

    def close(self) -> None:
        """Bring it onto the disk and give it back."""
        self._syncer.stop()
        with contextlib.suppress(OSError):
            os.close(self._fd)

    def _put(self, data: bytes) -> tuple[int, str | None]:
        """Bytes written, and why not all."""
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
