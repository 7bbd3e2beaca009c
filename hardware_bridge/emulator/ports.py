"""The device's end of a line: what a device writes there, the host reads."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, TypeAlias

MOST_KEPT = 1 << 16
"""[bytes] A line in memory keeps no more than this in each direction."""


@dataclass(slots=True)
class LineCounts:
    """What went over a line since it was made, in bytes."""

    written: int = 0
    """Taken by the line."""
    dropped: int = 0
    """The host did not read in time, and the line was full."""
    unheard: int = 0
    """The port was not open, or the device was unplugged."""
    read: int = 0


class DevicePort(Protocol):
    """The device's end. Nothing here ever waits."""

    counts: LineCounts

    @property
    def plugged(self) -> bool:
        """False after `unplug`."""

    def write(self, data: bytes) -> None:
        """Send; what does not go out at once is lost and counted."""

    def read(self) -> bytes:
        """All that the host has sent."""

    def unplug(self) -> None:
        """Pull the plug: the host's end is gone. Without effect where there is none."""

    def replug(self) -> None:
        """Plug in again, under the same name, as another device of the system."""


PortBuilder: TypeAlias = Callable[[str], DevicePort]
"""Name, such as ``n1``, to a new port."""


class MemoryPort:
    """A line without an operating system, for rigs that are stepped by hand.

    The host's end is `receive` and `send`; it always has the port open.
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
            self.counts.unheard += len(data)
            return
        taken = data[: MOST_KEPT - len(self._to_host)]
        self._to_host += taken
        self.counts.written += len(taken)
        self.counts.dropped += len(data) - len(taken)

    def read(self) -> bytes:
        """All that the host has sent."""
        data = bytes(self._to_device)
        self._to_device.clear()
        self.counts.read += len(data)
        return data

    def unplug(self) -> None:
        """What was under way is lost."""
        self._plugged = False
        self._to_host.clear()
        self._to_device.clear()

    def replug(self) -> None:
        """Carry on."""
        self._plugged = True

    def receive(self) -> bytes:
        """The host reads what is there."""
        data = bytes(self._to_host)
        self._to_host.clear()
        return data

    def send(self, data: bytes) -> None:
        """The host writes; what an unplugged device would get is lost."""
        if self._plugged:
            self._to_device += data[: MOST_KEPT - len(self._to_device)]
