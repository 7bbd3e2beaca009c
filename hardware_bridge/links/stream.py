"""Bytes through a descriptor that never blocks: what serial ports and sockets have in common.

Reads and writes go to the descriptor itself. pyserial's own `write` with a timeout of zero spins
for ever once the buffer is full (serialposix.py of 3.5), and its `read` costs a `select` each time.
"""

from __future__ import annotations

import os
import sys
from typing import Protocol

from hardware_bridge.links.failures import LinkLost, lost_by

MOST_AT_ONCE = 1 << 16
"""[bytes] Read from one port before the others have their turn."""
_PIECE = 1 << 14


class Port(Protocol):
    """An open port. Every failure is a `LinkLost`, and nothing blocks."""

    def fileno(self) -> int:
        """To wait for bytes with."""

    def read(self) -> bytes:
        """Everything that is there, up to `MOST_AT_ONCE` bytes; empty if there is nothing."""

    def write(self, data: bytes) -> bool:
        """Take all of `data`, or none of it and return False."""

    def flush(self) -> bool:
        """Go on with a message that was cut; True if nothing of it is left."""

    def close(self, linger: float = 0.0) -> None:
        """Close; what was written has `linger` seconds to leave. Never raises."""


class Stream:
    """Reads and writes of a descriptor in non-blocking mode.

    Law: a message is written whole or not at all, whatever is cut by a full buffer. So what is left
    of one message is kept, never a second one: commands do not pile up and grow old.
    """

    def __init__(self, fd: int, most_queued: int) -> None:
        """Take a descriptor; it stays the caller's to close.

        Args:
            fd: Non-blocking, where an empty read means that the other end is gone.
            most_queued: With more bytes than this on their way out, nothing more is taken.
        """
        self.fd = fd
        self._most_queued = most_queued
        self._rest = b""

    def read(self) -> bytes:
        """Drain; a loss is raised once there are no bytes left to hand over."""
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
        """Take a message if none is waiting; False if it was not taken."""
        if not data:
            return True
        if not self.flush() or self.queued() > self._most_queued:
            return False
        sent = self._send(data)
        if sent:
            self._rest = bytes(data[sent:])
        return sent > 0

    def flush(self) -> bool:
        """Go on with the message that was cut."""
        if self._rest:
            self._rest = self._rest[self._send(self._rest) :]
        return not self._rest

    def queued(self) -> int:
        """Bytes that were written and have not left; 0 where the system does not tell."""
        import fcntl
        import termios

        try:
            answer = fcntl.ioctl(self.fd, termios.TIOCOUTQ, bytes(4))
        except (OSError, ValueError, TypeError):
            return 0  # a write will say whether the port is lost
        return int.from_bytes(answer, sys.byteorder)

    def _send(self, data: bytes) -> int:
        try:
            return os.write(self.fd, data)
        except (BlockingIOError, InterruptedError):
            return 0
        except Exception as error:
            raise lost_by(error) from error
