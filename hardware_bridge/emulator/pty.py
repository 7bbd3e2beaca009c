"""Emulated serial port: a pseudo terminal behind a symbolic link with a fixed name.

Programs open the link like ``/dev/serial/by-id/...``, with the same calls and the same failures:
unplugging ends their reads, and the port comes back as another device with the same name.
"""

from __future__ import annotations

import errno
import os
import select
from contextlib import suppress
from pathlib import Path

from hardware_bridge.emulator.ports import LineCounts
from hardware_bridge.errors import BridgeError
from hardware_bridge.systems import expect_posix

READ_SIZE = 1 << 16
"""[bytes] Largest number of bytes per read."""
GONE = (errno.EIO, errno.EBADF)
"""Errors of the system if the other end is not open."""


class PtyPort:
    """The device's end of a pseudo terminal in raw mode; a `DevicePort`.

    As at a real port, bytes sent while no host has it open are lost. The buffer is that of the
    system, some ten thousand bytes.
    """

    def __init__(self, link: Path) -> None:
        """Create the terminal and the link.

        Args:
            link: Path of the link; an existing symbolic link is replaced.

        Raises:
            BridgeError: Another file is there, or the system provides no terminals.
        """
        if link.exists() and not link.is_symlink():
            raise BridgeError(f"{link}: expected a free name for a port, found a file")
        self.link = link
        self.counts = LineCounts()
        self._fd: int | None = None
        self._device = ""
        self._open()

    @property
    def plugged(self) -> bool:
        """False after `unplug`."""
        return self._fd is not None

    @property
    def is_open(self) -> bool:
        """True while a host has the port open."""
        if self._fd is None:
            return False
        poll = select.poll()
        poll.register(self._fd, select.POLLIN)
        return not any(event & select.POLLHUP for _, event in poll.poll(0))

    def write(self, data: bytes) -> None:
        """Send to the host; see `DevicePort`."""
        if not data:
            return
        if self._fd is None or not self.is_open:
            self.counts.unread += len(data)
            return
        try:
            taken = os.write(self._fd, data)
        except BlockingIOError:
            taken = 0
        except OSError as error:
            if error.errno not in GONE:
                raise
            self.counts.unread += len(data)
            return
        self.counts.written += taken
        self.counts.dropped += len(data) - taken

    def read(self) -> bytes:
        """Return all pending bytes of the host."""
        found = bytearray()
        while self._fd is not None:
            try:
                data = os.read(self._fd, READ_SIZE)
            except BlockingIOError:
                break
            except OSError as error:
                if error.errno not in GONE:
                    raise
                break
            if not data:
                break
            found += data
        self.counts.read += len(found)
        return bytes(found)

    def unplug(self) -> None:
        """Close the terminal and remove the link; a host that has it open reads end of file."""
        if self._fd is None:
            return
        with suppress(FileNotFoundError):
            # Another emulator may have put its own port there.
            if os.readlink(self.link) == self._device:
                self.link.unlink()
        os.close(self._fd)
        self._fd = None

    def replug(self) -> None:
        """Open a new terminal behind the same link.

        Raises:
            BridgeError: The system provides no terminals.
        """
        if self._fd is None:
            self._open()

    def _open(self) -> None:
        """Open a terminal in raw mode and point the link to it."""
        if not hasattr(os, "openpty"):
            raise BridgeError(
                f"{self.link}: this system has no pseudo terminals, use Linux or macOS"
            )
        # Imported here, since some systems lack it.
        import tty

        try:
            expect_posix("a pseudo terminal")
            device, host = os.openpty()
        except OSError as error:
            raise BridgeError(f"{self.link}: the system gives no pseudo terminal ({error})") from (
                error
            )
        # The settings persist while the host's end is closed, and only with this end closed can the
        # device detect whether a host has the port open.
        tty.setraw(host)
        self._device = os.ttyname(host)
        os.close(host)
        os.set_blocking(device, False)
        scratch = self.link.with_name(f".{self.link.name}.new")
        try:
            self.link.parent.mkdir(parents=True, exist_ok=True)
            with suppress(FileNotFoundError):
                scratch.unlink()
            scratch.symlink_to(self._device)
            os.replace(scratch, self.link)
        except OSError as error:
            os.close(device)
            raise BridgeError(f"{self.link}: cannot be made ({error})") from error
        self._fd = device
