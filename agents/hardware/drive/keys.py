"""Non-blocking keyboard input of the operator while cars drive."""

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
"""Operator command by key."""
ALIVE = "."
"""Heartbeat of a program that sends keys to standard input; it is no command."""
PATIENCE = 1.0
"""[s] Heartbeat timeout of that program, after which all cars are stopped."""
HELP = "space: emergency stop  c: clear  a: arm  d: disarm  g: silent are gone  q: quit"
"""Fits into a line of 80 characters."""
NO_KEYS = "no keys, cars are stopped: another program has the terminal, fg takes it back"
"""Fits into a line of 80 characters."""


def check_stop_source(source: str) -> None:
    """Check that a person can stop the cars.

    Args:
        source: ``terminal`` or ``stdin``.

    Raises:
        UsageError: There is no terminal in the foreground, or standard input is closed.
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
    r"""Read single key presses from the terminal inside the context; no effect without a terminal.

    Ctrl-S, Ctrl-Z and Ctrl-\ do not pause the output, suspend or kill the program: they stop the
    cars like any other key.
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
    """Set the terminal to single-key mode, also after a shell has changed the mode."""
    import termios

    if in_background():  # the system would suspend this program, and the cars with it
        return
    mode = termios.tcgetattr(sys.stdin)
    mode[0] &= ~(termios.IXON | termios.IXOFF)
    mode[3] &= ~(termios.ICANON | termios.ECHO)
    for key in (termios.VSUSP, termios.VQUIT):
        mode[6][key] = b"\0"
    termios.tcsetattr(sys.stdin, termios.TCSANOW, mode)


def in_background() -> bool:
    """Return whether keys go to another program, as after `kill -STOP` and `-CONT`."""
    try:
        return os.tcgetpgrp(sys.stdin.fileno()) != os.getpgrp()
    except (OSError, AttributeError):  # not the controlling terminal, or none
        return False


class PipedKeys:
    """Keys piped from a program (gamepad, switch), whose silence stops the cars."""

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        self._now, self._last_input, self._is_open = now, now(), True
        self.lost = False
        """Always False for piped keys; see `TerminalKeys.lost`."""

    def read_orders(self) -> list[str]:
        """Return the new commands in order; a stop after `PATIENCE` without input."""
        pressed = b""
        while self._is_open and select.select([sys.stdin], [], [], 0.0)[0]:
            keys = os.read(sys.stdin.fileno(), 1024)
            if not keys:
                self._is_open = False
                return ["stop", "quit"]
            pressed += keys
        if pressed:
            self._last_input = self._now()
            return orders_of(pressed.decode(errors="replace").replace(ALIVE, "").replace("\n", ""))
        if self._now() - self._last_input > PATIENCE:
            self._last_input = self._now()
            return ["stop"]
        return []


class TerminalKeys:
    """Keys of the terminal; the cars are stopped when another program takes over the terminal."""

    def __init__(self) -> None:
        self.lost = False
        """True while another program receives the keys."""

    def read_orders(self) -> list[str]:
        """Return the commands of newly pressed keys in order; only the stop if one is among them.

        Reads the file descriptor directly: text streams read ahead into a buffer that `select`
        does not see.
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
    """Return the commands of keys that were pressed together.

    Unknown keys stop the cars. A stop cancels all other keys, earlier and later: a hand on the
    keyboard presses keys at random, and arrow keys send letters after an escape. Keys after a
    quit are ignored.
    """
    orders = [KEYS.get(key.lower(), "stop") for key in pressed]
    if "stop" in orders:
        return ["stop"]
    return orders[: orders.index("quit") + 1] if "quit" in orders else orders


def _is_terminal() -> bool:
    """Return whether standard input is a terminal; it may also be closed."""
    return sys.stdin is not None and sys.stdin.isatty()
