"""The device's end of a line to the host."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, TypeAlias

MOST_KEPT = 1 << 16
"""[bytes] Size of the buffer of a line in memory, per direction."""


@dataclass(slots=True)
class LineCounts:
    """Numbers of bytes sent over a line since its creation."""

    written: int = 0
    """Bytes accepted by the line."""
    dropped: int = 0
    """Bytes lost because the line was full: the host did not read in time."""
    unread: int = 0
    """Bytes lost because the port was not open or the device was unplugged."""
    read: int = 0


class DevicePort(Protocol):
    """The device's end of a line; its methods never block."""

    counts: LineCounts

    @property
    def plugged(self) -> bool:
        """False after `unplug`."""

    def write(self, data: bytes) -> None:
        """Send bytes; those that cannot be sent at once are lost and counted."""

    def read(self) -> bytes:
        """Return all pending bytes of the host."""

    def unplug(self) -> None:
        """Unplug the device and close the host's end. No effect if it is unplugged."""

    def replug(self) -> None:
        """Plug in again, with the same name, as another device of the system."""


PortBuilder: TypeAlias = Callable[[str], DevicePort]
"""Name, such as ``n1``, to a new port."""


class MemoryPort:
    """A line without an operating system, for tests that are stepped manually.

    `receive` and `send` are the host's end, which is always open.
    """

    def __init__(self) -> None:
        self.counts = LineCounts()
        self._to_host, self._to_device = bytearray(), bytearray()
        self._plugged = True

    @property
    def plugged(self) -> bool:
        """False after `unplug`."""
        return self._plugged

    def write(self, data: bytes) -> None:
        """Send to the host; see `DevicePort`."""
        if not self._plugged:
            self.counts.unread += len(data)
            return
        taken = data[: MOST_KEPT - len(self._to_host)]
        self._to_host += taken
        self.counts.written += len(taken)
        self.counts.dropped += len(data) - len(taken)

    def read(self) -> bytes:
        """Return all pending bytes of the host."""
        data = bytes(self._to_device)
        self._to_device.clear()
        self.counts.read += len(data)
        return data

    def unplug(self) -> None:
        """Unplug; bytes in both buffers are lost."""
        self._plugged = False
        self._to_host.clear()
        self._to_device.clear()

    def replug(self) -> None:
        """Plug in again."""
        self._plugged = True

    def receive(self) -> bytes:
        """Return the pending bytes for the host."""
        data = bytes(self._to_host)
        self._to_host.clear()
        return data

    def send(self, data: bytes) -> None:
        """Send bytes from the host; they are lost while the device is unplugged."""
        if self._plugged:
            self._to_device += data[: MOST_KEPT - len(self._to_device)]
