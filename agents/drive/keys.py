"""Keys of the terminal while cars drive, read without waiting."""

from __future__ import annotations

import contextlib
import os
import select
import sys
from collections.abc import Iterator

KEYS = {" ": "stop", "a": "arm", "d": "disarm", "c": "clear", "q": "quit"}
"""Key to order; space is the largest, and stops."""
HELP = "space: emergency stop   c: clear it   a: arm   d: disarm   q: quit"


@contextlib.contextmanager
def key_by_key() -> Iterator[None]:
    """Let the terminal hand on every key at once, while this lasts; nothing without a terminal."""
    if not _is_terminal():
        yield
        return
    import termios
    import tty

    before = termios.tcgetattr(sys.stdin)
    tty.setcbreak(sys.stdin)
    try:
        yield
    finally:
        with contextlib.suppress(termios.error):  # it was closed
            termios.tcsetattr(sys.stdin, termios.TCSADRAIN, before)


def read_orders() -> list[str]:
    """What was pressed since the last look, in order; a stop alone where one is among it.

    The descriptor itself is read: text streams keep what they have read ahead, and no `select`
    tells of it.
    """
    pressed = b""
    while _is_terminal() and select.select([sys.stdin], [], [], 0.0)[0]:
        keys = os.read(sys.stdin.fileno(), 1024)
        if not keys:
            break
        pressed += keys
    return orders_of(pressed.decode(errors="replace"))


def orders_of(pressed: str) -> list[str]:
    """What keys that were hit together mean.

    Whatever else is hit in a hurry stops as well. Nothing beside a stop counts, before it or
    after: a hand on the keyboard means none of it, and the arrow keys are letters behind an escape.
    Nothing counts after a quit.
    """
    orders = [KEYS.get(key.lower(), "stop") for key in pressed]
    if "stop" in orders:
        return ["stop"]
    return orders[: orders.index("quit") + 1] if "quit" in orders else orders


def _is_terminal() -> bool:
    """Whether there is one; a program can be started with its input closed."""
    return sys.stdin is not None and sys.stdin.isatty()
