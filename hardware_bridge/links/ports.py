"""Where a stream of bytes comes from: what a configuration says of a port."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class PortSpec:
    """One port; nothing about it is guessed."""

    name: str
    """What it is called in messages and recordings, ``links.left`` or ``cars.1``."""
    port: str
    """A device path such as ``/dev/serial/by-id/...``, ``serial:NUMBER`` for the USB serial
    number of an adapter, ``tcp:host:port``, or ``file:path`` for a file that may still grow."""
    baud: int = 115200
    """[1/s] Without meaning for TCP and files."""
    request: bytes = b""
    """Sent as the port comes up, and again while it is silent, to a device that must be asked."""
    dtr: bool = True
    """The line DTR of a serial port while it is open."""


@dataclass(frozen=True, slots=True)
class Chunk:
    """Bytes that were read from a port at once."""

    link: str
    """`PortSpec.name`."""
    t_ns: int
    """When they were read, by the host's monotonic clock [ns]."""
    data: bytes
