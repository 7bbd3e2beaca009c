"""Keys of the terminal while cars drive, read without waiting."""

from __future__ import annotations

import contextlib
import os
import select
import signal
import sys
import time
from collections.abc import Callable, Iterator

from agents.errors import UsageError

KEYS = {" ": "stop", "a": "arm", "d": "disarm", "c": "clear", "g": "gone", "q": "quit"}
"""Key to order; space is the largest, and stops."""
ALIVE = "."
"""What a program that stops the cars through standard input says to be alive; it asks for
nothing."""
PATIENCE = 1.0
"""[s] Without a word from it, all cars are stopped."""
HELP = "space: emergency stop  c: clear  a: arm  d: disarm  g: silent are gone  q: quit"
"""In one line of 80 letters."""
NO_KEYS = "no keys, cars are stopped: another program has the terminal, fg takes it back"
"""In one line, too."""


def check_stop_source(source: str) -> None:
    """See that a person can stop the cars.

    Args:
        source: ``terminal`` or ``stdin``.

    Raises:
        UsageError: There is no terminal.
    """
    if source == "terminal" and (not _is_terminal() or in_background()):
        raise UsageError(
            "--arm: expected a terminal, on which space stops the cars, and to be in its "
            "foreground; a program that stops them writes keys to standard input, see --stop-source"
        )
    if source == "stdin" and (sys.stdin is None or sys.stdin.closed):
        raise UsageError("--stop-source: expected standard input to be open")


@contextlib.contextmanager
def key_by_key() -> Iterator[None]:
    r"""Let the terminal hand on every key at once, while this lasts; nothing without a terminal.

    No key stops the screen, suspends or kills the program: Ctrl-S, Ctrl-Z and Ctrl-\ stop the cars
    like any other key.
    """
    if not _is_terminal():
        yield
        return
    import termios

    before = termios.tcgetattr(sys.stdin)
    _take_keys()
    resumed = signal.signal(signal.SIGCONT, _take_keys)
    try:
        yield
    finally:
        signal.signal(signal.SIGCONT, resumed)
        with contextlib.suppress(termios.error):  # it was closed
            if not in_background():
                termios.tcsetattr(sys.stdin, termios.TCSADRAIN, before)


def _take_keys(*_: object) -> None:
    """Set the terminal to single keys, as a shell that had it meanwhile has changed that."""
    import termios

    if in_background():  # the system would halt this program, and the cars with it
        return
    mode = termios.tcgetattr(sys.stdin)
    mode[0] &= ~(termios.IXON | termios.IXOFF)
    mode[3] &= ~(termios.ICANON | termios.ECHO)
    for key in (termios.VSUSP, termios.VQUIT):
        mode[6][key] = b"\0"
    termios.tcsetattr(sys.stdin, termios.TCSANOW, mode)


def in_background() -> bool:
    """Whether the terminal's keys go to another program, as after `kill -STOP` and `-CONT`."""
    try:
        return os.tcgetpgrp(sys.stdin.fileno()) != os.getpgrp()
    except (OSError, AttributeError):  # not the terminal that rules this program, or none
        return False


class PipedKeys:
    """Keys from a program, a gamepad's or a switch's, whose silence stops the cars."""

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        self._now, self._heard, self._is_open = now, now(), True
        self.lost = False
        """Never by another program, see `TerminalKeys`."""

    def read_orders(self) -> list[str]:
        """What came since the last look, in order; a stop when nothing did for `PATIENCE`."""
        pressed = b""
        while self._is_open and select.select([sys.stdin], [], [], 0.0)[0]:
            keys = os.read(sys.stdin.fileno(), 1024)
            if not keys:
                self._is_open = False
                return ["stop", "quit"]
            pressed += keys
        if pressed:
            self._heard = self._now()
            return orders_of(pressed.decode(errors="replace").replace(ALIVE, "").replace("\n", ""))
        if self._now() - self._heard > PATIENCE:
            self._heard = self._now()
            return ["stop"]
        return []


class TerminalKeys:
    """Keys of the terminal; when they begin to go to another program, the cars are stopped."""

    def __init__(self) -> None:
        self.lost = False
        """Whether they go to another program."""

    def read_orders(self) -> list[str]:
        """What was pressed since the last look, in order; a stop alone where one is among it.

        The descriptor itself is read: text streams keep what they have read ahead, and no `select`
        tells of it.
        """
        had_them, self.lost = not self.lost, in_background()
        if self.lost:
            return ["stop"] if had_them else []
        if not had_them:
            _take_keys()  # a shell that counts this program as running sends no signal
        pressed = b""
        while _is_terminal() and select.select([sys.stdin], [], [], 0.0)[0]:
            keys = os.read(sys.stdin.fileno(), 1024)
            if not keys:
                break
            pressed += keys
        return orders_of(pressed.decode(errors="replace"))


def orders_of(pressed: str) -> list[str]:
    """What keys that were hit together mean.

    Whatever else is hit in a hurry stops as well. No other key pressed with a stop counts, before
    it or after: a hand on the keyboard means none of it, and the arrow keys are letters behind an
    escape. Nothing counts after a quit.
    """
    orders = [KEYS.get(key.lower(), "stop") for key in pressed]
    if "stop" in orders:
        return ["stop"]
    return orders[: orders.index("quit") + 1] if "quit" in orders else orders


def _is_terminal() -> bool:
    """Whether there is one; a program can be started with its input closed."""
    return sys.stdin is not None and sys.stdin.isatty()
