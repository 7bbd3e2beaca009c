"""Configuration of ports, and chunks of received bytes."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class PortSpec:
    """Complete configuration of one port; nothing is guessed."""

    name: str
    """Name in messages and recordings, ``links.left`` or ``cars.1``."""
    port: str
    """A device path such as ``/dev/serial/by-id/...``, ``serial:NUMBER`` for the USB serial
    number of an adapter, ``tcp:host:port``, or ``file:path`` for a file that may still grow."""
    baud: int = 115200
    """[1/s] Baud rate; without effect for TCP and files."""
    request: bytes = b""
    """Sent when the port opens and while it is silent, for devices that measure on request."""
    dtr: bool = True
    """State of the DTR line of a serial port while it is open."""


@dataclass(frozen=True, slots=True)
class Chunk:
    """Bytes of one read from a port."""

    link: str
    """`PortSpec.name`."""
    t_ns: int
    """Time of the read, by the host's monotonic clock [ns]."""
    data: bytes
