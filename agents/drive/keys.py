"""Keys of the terminal while cars drive, read without waiting."""

from __future__ import annotations

import contextlib
import select
import sys
from collections.abc import Iterator

KEYS = {" ": "stop", "a": "arm", "d": "disarm", "c": "clear", "q": "quit"}
"""Key to order; space is the largest, and stops."""
HELP = "space: emergency stop   c: clear it   a: arm   d: disarm   q: quit"


@contextlib.contextmanager
def key_by_key() -> Iterator[None]:
    """Let the terminal hand on every key at once, while this lasts; nothing without a terminal."""
    if not sys.stdin.isatty():
        yield
        return
    import termios
    import tty

    before = termios.tcgetattr(sys.stdin)
    tty.setcbreak(sys.stdin)
    try:
        yield
    finally:
        termios.tcsetattr(sys.stdin, termios.TCSADRAIN, before)


def read_orders() -> list[str]:
    """What was pressed and means something."""
    pressed = []
    while sys.stdin.isatty() and select.select([sys.stdin], [], [], 0.0)[0]:
        key = sys.stdin.read(1)
        if not key:
            break
        # Whatever else is hit in a hurry stops as well.
        pressed.append(KEYS.get(key.lower(), "stop"))
    return pressed
