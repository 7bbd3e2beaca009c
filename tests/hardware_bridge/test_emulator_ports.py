"""Pseudo terminals behave like serial devices that are plugged in and unplugged."""

import os
import select
import termios
import time
from contextlib import suppress

import pytest

from hardware_bridge.emulator.ports import MOST_KEPT, MemoryPort
from hardware_bridge.emulator.pty import PtyPort
from hardware_bridge.errors import BridgeError


@pytest.fixture
def port(tmp_path):
    port = PtyPort(tmp_path / "n1")
    yield port
    port.unplug()


def open_host(link):
    return os.open(link, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)


def read_host(fd, n, seconds=5.0):
    """Read n bytes, or as many as arrive before the end of file or the timeout."""
    found, end = b"", time.monotonic() + seconds
    while len(found) < n and time.monotonic() < end:
        if select.select([fd], [], [], 0.1)[0]:
            data = os.read(fd, 1 << 16)
            if not data:
                break
            found += data
    return found


def read_device(port, n, seconds=5.0):
    found, end = b"", time.monotonic() + seconds
    while len(found) < n and time.monotonic() < end:
        found += port.read()
        time.sleep(0.001)
    return found


def test_every_byte_goes_through_both_ways(port):
    everything = bytes(range(256)) * 4
    host = open_host(port.link)
    try:
        assert port.is_open
        port.write(everything)
        assert read_host(host, len(everything)) == everything
        os.write(host, everything)
        assert read_device(port, len(everything)) == everything
        assert not termios.tcgetattr(host)[3] & (termios.ECHO | termios.ICANON)
    finally:
        os.close(host)
    assert port.counts.written == port.counts.read == len(everything)
    assert port.counts.dropped == port.counts.unread == 0


def test_what_nobody_hears_is_lost(port):
    port.write(b"before")
    assert port.counts.unread == 6
    host = open_host(port.link)
    try:
        port.write(b"after")
        assert read_host(host, 5) == b"after"
    finally:
        os.close(host)


def test_a_host_that_does_not_read_holds_up_nobody(port):
    host = open_host(port.link)
    try:
        for _ in range(300):
            port.write(bytes(1000))
        counts = port.counts
        assert counts.dropped > 0
        assert counts.written + counts.dropped == 300_000
        assert read_host(host, counts.written) == bytes(counts.written)
    finally:
        os.close(host)


def test_unplugged_it_is_gone_and_comes_back_under_its_name(port):
    host = open_host(port.link)
    try:
        port.unplug()
        port.unplug()
        assert not port.plugged
        assert not port.link.is_symlink()
        with suppress(OSError):  # raised by other systems
            assert os.read(host, 10) == b""
        port.write(b"nobody")
        assert port.read() == b""
        assert port.counts.unread == 6
    finally:
        os.close(host)
    port.replug()
    host = open_host(port.link)
    try:
        port.write(b"again")
        assert read_host(host, 5) == b"again"
    finally:
        os.close(host)


def test_the_link_of_another_is_left_alone(tmp_path):
    first = PtyPort(tmp_path / "n1")
    second = PtyPort(tmp_path / "n1")
    first.unplug()
    assert (tmp_path / "n1").exists()
    second.unplug()
    assert not (tmp_path / "n1").is_symlink()


def test_a_file_is_not_replaced(tmp_path):
    (tmp_path / "n1").write_text("mine")
    with pytest.raises(BridgeError, match="n1: expected a free name"):
        PtyPort(tmp_path / "n1")
    assert (tmp_path / "n1").read_text() == "mine"


def test_a_line_in_memory_is_bounded_and_forgets_when_unplugged():
    port = MemoryPort()
    port.write(bytes(MOST_KEPT + 10))
    assert (port.counts.written, port.counts.dropped) == (MOST_KEPT, 10)
    port.send(b"abc")
    port.unplug()
    port.send(b"def")
    port.write(b"x")
    assert port.read() == port.receive() == b""
    port.replug()
    port.send(b"ghi")
    port.write(b"y")
    assert (port.read(), port.receive()) == (b"ghi", b"y")
