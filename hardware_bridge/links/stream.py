"""Non-blocking streams of bytes: the common part of serial ports and sockets.

Reads and writes use the descriptor itself. pyserial's own `write` with a timeout of zero spins
forever once the buffer is full (serialposix.py of 3.5), and its `read` costs a `select` each time.
"""

from __future__ import annotations

import os
import sys
from typing import Protocol

from hardware_bridge.links.failures import LinkLost, lost_by

MOST_AT_ONCE = 1 << 16
"""[bytes] Largest number of bytes read from one port before the others are read."""
_PIECE = 1 << 14


class Port(Protocol):
    """An open port. Every failure is a `LinkLost`, and no method blocks."""

    def fileno(self) -> int:
        """Return the descriptor to wait for bytes with."""

    def read(self) -> bytes:
        """Return all pending bytes, up to `MOST_AT_ONCE`; empty if there are none."""

    def write(self, data: bytes) -> bool:
        """Accept all of `data` and return True, or none of it and return False."""

    def flush(self) -> bool:
        """Continue to send a partly sent message; return True if nothing of it is left."""

    def close(self, linger: float = 0.0) -> None:
        """Close; written bytes have `linger` seconds to be sent. Never raises."""


class Stream:
    """Reads and writes of a non-blocking descriptor.

    Invariant: a message is written whole or not at all, even if a full buffer cuts it. The rest of
    at most one message is kept, so that commands do not queue up and become outdated.
    """

    def __init__(self, fd: int, most_queued: int) -> None:
        """Create a stream on a descriptor, which the caller closes.

        Args:
            fd: Non-blocking descriptor; an empty read means that the other end is closed.
            most_queued: Largest number of queued bytes at which a message is accepted.
        """
        self.fd = fd
        self._most_queued = most_queued
        self._rest = b""

    def read(self) -> bytes:
        """Read all pending bytes; raise a loss once there are none to return."""
        pieces: list[bytes] = []
        size = 0
        while size < MOST_AT_ONCE:
            try:
                piece = os.read(self.fd, min(_PIECE, MOST_AT_ONCE - size))
                if not piece:
                    raise LinkLost("unplugged, or its other end closed (readable, but empty)")
            except (BlockingIOError, InterruptedError):
                break
            except Exception as error:
                if pieces:
                    break
                raise lost_by(error) from error
            pieces.append(piece)
            size += len(piece)
        return b"".join(pieces)

    def write(self, data: bytes) -> bool:
        """Accept a message if none is pending; return False if it was not accepted."""
        if not data:
            return True
        if not self.flush() or self.queued() > self._most_queued:
            return False
        sent = self._send(data)
        if sent:
            self._rest = bytes(data[sent:])
        return sent > 0

    def flush(self) -> bool:
        """Continue to send the partly sent message."""
        if self._rest:
            self._rest = self._rest[self._send(self._rest) :]
        return not self._rest

    def queued(self) -> int:
        """Return the number of written bytes not sent yet; 0 if the system does not report it."""
        import fcntl
        import termios

        try:
            answer = fcntl.ioctl(self.fd, termios.TIOCOUTQ, bytes(4))
        except (OSError, ValueError, TypeError):
            return 0  # the next write detects a lost port
        return int.from_bytes(answer, sys.byteorder)

    def _send(self, data: bytes) -> int:
        try:
            return os.write(self.fd, data)
        except (BlockingIOError, InterruptedError):
            return 0
        except Exception as error:
            raise lost_by(error) from error
