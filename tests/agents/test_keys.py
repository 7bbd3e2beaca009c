"""Keys of the terminal while cars drive."""

import os
import pty
import sys

import pytest

from agents.drive.keys import key_by_key, orders_of, read_orders


@pytest.fixture
def keyboard(monkeypatch):
    """A terminal; what is written is pressed."""
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
    assert read_orders() == []
    keyboard(keys)
    assert read_orders() == orders
    assert read_orders() == []


def test_nothing_beside_a_stop_counts():
    assert orders_of("acda q") == ["stop"]
    assert orders_of("") == []


def test_nothing_counts_after_a_quit():
    assert orders_of("aqa") == ["arm", "quit"]


def test_without_any_input_no_key_is_pressed(monkeypatch):
    monkeypatch.setattr(sys, "stdin", None)  # as where a shell has closed it
    with key_by_key():
        assert read_orders() == []
