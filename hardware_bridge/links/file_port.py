"""A stream from a file, read from its start and followed while it grows.

A regular file is always readable, so nothing waits for it: a thread looks for more, and what it
finds goes through a pipe. A file that became shorter, was replaced or removed is a port that is
lost; opened again it is read from its start.
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
"""[s] From one look at the end of the file to the next."""
RENAMED = 50
"""[-] Looks from one to the next at whether the path still leads to the file."""
PIECE = 1 << 14
"""[bytes]"""


class FilePort:
    """A file ``file:path``, as ``tail -f`` from its first byte. It implements `Port`."""

    def __init__(self, spec: PortSpec) -> None:
        """Open the file.

        Raises:
            BridgeError: There is none; says what to do.
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
        """To wait for bytes with."""
        return self._stream.fd

    def read(self) -> bytes:
        """Everything that is there."""
        try:
            return self._stream.read()
        except LinkLost as lost:
            raise LinkLost(self._reason or lost.reason) from lost

    def write(self, data: bytes) -> bool:
        """Refuse: a file that measures is not written to."""
        return not data

    def flush(self) -> bool:
        """Nothing is ever left."""
        return True

    def close(self, linger: float = 0.0) -> None:
        """Close."""
        if self._closed:
            return
        self._closed = True
        self._ending.set()
        self._thread.join()
        os.close(self._end)

    def _follow(self) -> None:
        """Of the thread: the file to the pipe, until it is closed or the file is another."""
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
        """Into the pipe, as soon as there is room for it."""
        while piece and not self._ending.is_set():
            with contextlib.suppress(BlockingIOError):
                piece = piece[os.write(self._begin, piece) :]
                continue
            self._ending.wait(LOOK)

    def _check(self, by_name: bool) -> None:
        """Find out whether it is still the same file, and no shorter.

        Raises:
            LinkLost: It is not.
        """
        here = os.fstat(self._file)
        if here.st_size < os.lseek(self._file, 0, os.SEEK_CUR):
            raise LinkLost("the file became shorter")
        if by_name:
            there = self._path.stat()
            if (there.st_dev, there.st_ino) != (here.st_dev, here.st_ino):
                raise LinkLost("the file was replaced")
