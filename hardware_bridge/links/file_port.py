"""Stream from a file, read from its start and followed while it grows.

A regular file is always readable, so it cannot be polled: a thread reads appended bytes and passes
them on through a pipe. A file that became shorter, was replaced or removed counts as a lost port;
when opened again, it is read from its start.
"""

from __future__ import annotations

import contextlib
import os
import stat
import threading
from pathlib import Path

from hardware_bridge.errors import BridgeError
from hardware_bridge.links.failures import LinkLost, reason_of
from hardware_bridge.links.ports import PortSpec
from hardware_bridge.links.stream import Stream

LOOK = 0.01
"""[s] Polling interval for the end of the file."""
RENAMED = 50
"""[-] Number of polls between checks that the path still leads to the file."""
PIECE = 1 << 14
"""[bytes] Largest number of bytes per read."""


class FilePort:
    """A file ``file:path``, read like ``tail -f`` from its first byte. Implements `Port`."""

    def __init__(self, spec: PortSpec) -> None:
        """Open the file.

        Raises:
            BridgeError: The file cannot be opened; the message names a remedy.
        """
        self._path = Path(spec.port.removeprefix("file:"))
        try:
            self._file = os.open(self._path, os.O_RDONLY | os.O_NONBLOCK)
        except OSError as error:
            raise BridgeError(
                f"{spec.name}: cannot open the file {self._path}: {reason_of(error)}; start what "
                "should write it, or correct the path"
            ) from error
        if not stat.S_ISREG(os.fstat(self._file).st_mode):
            os.close(self._file)
            raise BridgeError(f"{spec.name}: {self._path} is no file, expected one to read from")
        self._ending = threading.Event()
        self._reason = ""
        self._end, self._begin = os.pipe()
        os.set_blocking(self._end, False)
        os.set_blocking(self._begin, False)
        self._stream = Stream(self._end, 0)
        self._closed = False
        self._thread = threading.Thread(target=self._follow, name=spec.name, daemon=True)
        self._thread.start()

    def fileno(self) -> int:
        """Return the descriptor to wait for bytes with."""
        return self._stream.fd

    def read(self) -> bytes:
        """Return all pending bytes."""
        try:
            return self._stream.read()
        except LinkLost as lost:
            raise LinkLost(self._reason or lost.reason) from lost

    def write(self, data: bytes) -> bool:
        """Refuse any data, since files are only read."""
        return not data

    def flush(self) -> bool:
        """Return True, since nothing is ever pending."""
        return True

    def close(self, linger: float = 0.0) -> None:
        """Close the file and end the thread."""
        if self._closed:
            return
        self._closed = True
        self._ending.set()
        self._thread.join()
        os.close(self._end)

    def _follow(self) -> None:
        """Copy the file to the pipe until it is closed or replaced; run by the thread."""
        try:
            looks = 0
            while not self._ending.is_set():
                piece = os.read(self._file, PIECE)
                if piece:
                    self._pass_on(piece)
                    continue
                looks += 1
                self._check(by_name=looks % RENAMED == 0)
                self._ending.wait(LOOK)
        except (LinkLost, OSError) as error:
            self._reason = reason_of(error)
        finally:
            os.close(self._file)
            os.close(self._begin)

    def _pass_on(self, piece: bytes) -> None:
        """Write bytes into the pipe as soon as it has space."""
        while piece and not self._ending.is_set():
            with contextlib.suppress(BlockingIOError):
                piece = piece[os.write(self._begin, piece) :]
                continue
            self._ending.wait(LOOK)

    def _check(self, by_name: bool) -> None:
        """Check that the file is the same one, and not shorter.

        Raises:
            LinkLost: The file is shorter or was replaced.
        """
        here = os.fstat(self._file)
        if here.st_size < os.lseek(self._file, 0, os.SEEK_CUR):
            raise LinkLost("the file became shorter")
        if by_name:
            there = self._path.stat()
            if (there.st_dev, there.st_ino) != (here.st_dev, here.st_ino):
                raise LinkLost("the file was replaced")
