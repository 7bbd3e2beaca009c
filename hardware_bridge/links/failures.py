"""Conversion of the many errors of a lost port to one exception.

An unplugged adapter causes a hang-up of poll, an OSError (EIO, ENXIO, ENODEV), an empty read of a
readable port, pyserial's SerialException with or without a number, its PortNotOpenError, a
termios.error, which is no OSError, or a TypeError or ValueError if the descriptor was closed
elsewhere. All of them mean that the port is gone.
"""

from __future__ import annotations

import errno
import os

_WORDS = {
    errno.EIO: "unplugged, or its other end closed",
    errno.ENXIO: "unplugged",
    errno.ENODEV: "unplugged",
    errno.ENOENT: "not there",
    errno.EBADF: "closed",
    errno.EPIPE: "closed by the other end",
    errno.ECONNRESET: "closed by the other end",
    errno.ECONNREFUSED: "no program listens there",
    errno.ETIMEDOUT: "no answer",
    errno.EHOSTUNREACH: "no way to that host",
    errno.ENETUNREACH: "no way to that host",
}


class LinkLost(Exception):
    """Loss of an open port, or a failed attempt to open it again."""

    def __init__(self, reason: str) -> None:
        super().__init__(reason)
        self.reason = reason
        """Reason as a text."""


def lost_by(error: BaseException) -> LinkLost:
    """Return the `LinkLost` for any exception of a port."""
    return error if isinstance(error, LinkLost) else LinkLost(reason_of(error))


def reason_of(error: BaseException) -> str:
    """Return a short description of an exception of a port."""
    number = number_of(error)
    if number in _WORDS:
        return f"{_WORDS[number]} ({errno.errorcode[number]})"
    if number is not None and number in errno.errorcode:
        return f"{os.strerror(number)} ({errno.errorcode[number]})"
    if isinstance(error, TimeoutError):
        return _WORDS[errno.ETIMEDOUT]
    if isinstance(error, TypeError | ValueError):
        return f"closed ({type(error).__name__})"
    text = " ".join(str(error).split())
    return text or type(error).__name__


def number_of(error: BaseException) -> int | None:
    """Return the errno of an OSError, of a SerialException that has one, or of termios.error."""
    number = getattr(error, "errno", None)
    if number is None and error.args and type(error).__module__ == "termios":
        number = error.args[0]
    return number if isinstance(number, int) else None
