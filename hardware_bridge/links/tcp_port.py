"""Stream over TCP: a serial server, or a node with a network interface."""

from __future__ import annotations

import contextlib
import socket
import time

from hardware_bridge.errors import BridgeError
from hardware_bridge.links.failures import reason_of
from hardware_bridge.links.ports import PortSpec
from hardware_bridge.links.stream import Stream

CONNECT_TIME = 2.0
"""[s] Timeout of connecting."""
MOST_QUEUED = 1024
"""[bytes] Largest number of unacknowledged bytes; more means that the peer does not keep up."""
SILENT_TIME = 3
"""[s] Time without an answer to keep-alive after which the peer is lost."""


class TcpPort:
    """A connection to ``tcp:host:port``. Implements `Port`."""

    def __init__(self, spec: PortSpec) -> None:
        """Connect.

        Raises:
            BridgeError: No connection; the message names a remedy.
        """
        host, port = tcp_address(spec)
        try:
            self._socket = socket.create_connection((host, port), timeout=CONNECT_TIME)
        except UnicodeError as error:
            raise BridgeError(f"{spec.name}: {host!r} is no name of a host") from error
        except OSError as error:
            raise BridgeError(
                f"{spec.name}: cannot connect to {host} port {port}: {reason_of(error)}; "
                "start what should listen there, or correct the address"
            ) from error
        try:
            _set_options(self._socket)
        except OSError as error:
            self._socket.close()
            raise BridgeError(f"{spec.name}: {host} port {port}: {reason_of(error)}") from error
        self._stream = Stream(self._socket.fileno(), MOST_QUEUED)

    def fileno(self) -> int:
        """Return the descriptor to wait for bytes with."""
        return self._stream.fd

    def read(self) -> bytes:
        """Return all pending bytes."""
        return self._stream.read()

    def write(self, data: bytes) -> bool:
        """Accept all of `data`, or none of it; return whether it was accepted."""
        return self._stream.write(data)

    def flush(self) -> bool:
        """Continue to send a partly sent message."""
        return self._stream.flush()

    def close(self, linger: float = 0.0) -> None:
        """Close the connection after at most `linger` seconds for a partly sent message."""
        with contextlib.suppress(Exception):
            for _ in range(round(linger / 0.001)):
                if self._stream.flush():
                    break
                time.sleep(0.001)
        with contextlib.suppress(OSError):
            self._socket.close()


def tcp_address(spec: PortSpec) -> tuple[str, int]:
    """Return the host and port of ``tcp:host:port``.

    Raises:
        BridgeError: The address has another form.
    """
    host, _, digits = spec.port.removeprefix("tcp:").rpartition(":")
    host = host.removeprefix("[").removesuffix("]")
    number = int(digits) if digits.isascii() and digits.isdigit() and len(digits) < 6 else 0
    if not host or not 0 < number < 65536:
        raise BridgeError(f"{spec.name}: expected tcp:host:port, got {spec.port!r}")
    return host, number


def _set_options(connection: socket.socket) -> None:
    connection.setblocking(False)
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for name, value in (
        ("TCP_KEEPIDLE", 1),
        ("TCP_KEEPINTVL", 1),
        ("TCP_KEEPCNT", SILENT_TIME - 1),
        ("TCP_USER_TIMEOUT", 1000 * SILENT_TIME),
    ):
        if hasattr(socket, name):  # system dependent
            connection.setsockopt(socket.IPPROTO_TCP, getattr(socket, name), value)
