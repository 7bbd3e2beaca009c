"""Keys of the terminal while cars drive."""

import os
import pty
import subprocess
import sys

import pytest

from agents.hardware.drive.keys import HELP, NO_KEYS, TerminalKeys, key_by_key, orders_of


@pytest.fixture
def keyboard(monkeypatch):
    """Return a terminal; writing to it presses keys."""
    ours, theirs = pty.openpty()
    with os.fdopen(theirs, "r") as stdin:
        monkeypatch.setattr(sys, "stdin", stdin)
        with key_by_key():
            yield lambda keys: os.write(ours, keys)
    os.close(ours)


@pytest.mark.parametrize(("keys", "orders"), [
    (b"a", ["arm"]), (b"Ad", ["arm", "disarm"]), (b" ", ["stop"]), (b"c ", ["stop"]),
    (b"a ", ["stop"]), (b"ca", ["clear", "arm"]), (b"jkl", ["stop"]), (b"q", ["quit"]),
    (b"\x1b[C", ["stop"]), ("\u00e4".encode(), ["stop"]), (b"\xff", ["stop"]),
])  # fmt: skip
def test_keys_that_are_hit_together_are_all_heard_at_once(keyboard, keys, orders):
    source = TerminalKeys()
    assert source.read_orders() == []
    keyboard(keys)
    assert source.read_orders() == orders
    assert source.read_orders() == []


def test_nothing_beside_a_stop_counts():
    assert orders_of("acda q") == ["stop"]
    assert orders_of("") == []


def test_nothing_counts_after_a_quit():
    assert orders_of("aqa") == ["arm", "quit"]


def test_without_any_input_no_key_is_pressed(monkeypatch):
    monkeypatch.setattr(sys, "stdin", None)  # as when a shell has closed it
    with key_by_key():
        assert TerminalKeys().read_orders() == []


BACKGROUND = """
import fcntl, os, signal, sys, termios, time
from agents.hardware.drive.keys import TerminalKeys, check_stop_source, key_by_key
from agents.errors import UsageError

os.setsid()
sys.stdin = os.fdopen(os.open(sys.argv[1], os.O_RDWR), "r")
fcntl.ioctl(sys.stdin, termios.TIOCSCTTY, 0)
other = os.fork()
if other == 0:
    os.setpgid(0, 0)
    time.sleep(60)
os.setpgid(other, other)
by_line = lambda: bool(termios.tcgetattr(sys.stdin)[3] & termios.ICANON)
signal.signal(signal.SIGTTOU, signal.SIG_IGN)
keys = TerminalKeys()
with key_by_key():
    assert keys.read_orders() == [] and not by_line()
    os.tcsetpgrp(sys.stdin.fileno(), other)  # a shell gives it to another
    mode = termios.tcgetattr(sys.stdin)
    mode[3] |= termios.ICANON
    termios.tcsetattr(sys.stdin, termios.TCSANOW, mode)
    signal.signal(signal.SIGTTOU, signal.SIG_DFL)
    assert keys.read_orders() == ["stop"] and keys.lost
    assert keys.read_orders() == []
    os.kill(os.getpid(), signal.SIGCONT)
    assert by_line()
    try:
        check_stop_source("terminal")
        sys.exit("armed in the background")
    except UsageError:
        pass
    signal.signal(signal.SIGTTOU, signal.SIG_IGN)
    os.tcsetpgrp(sys.stdin.fileno(), os.getpgrp())  # fg, of a program that runs: no signal
    assert by_line()
    assert keys.read_orders() == [] and not keys.lost
    assert not by_line()
os.kill(other, signal.SIGKILL)
"""


def test_a_terminal_that_another_program_has_stops_the_cars_and_comes_back():
    ours, theirs = pty.openpty()
    done = subprocess.run(
        [sys.executable, "-c", BACKGROUND, os.ttyname(theirs)],
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    os.close(ours)
    os.close(theirs)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_what_keys_do_is_said_in_a_line_of_a_small_terminal():
    assert max(len(HELP), len(NO_KEYS)) <= 80
