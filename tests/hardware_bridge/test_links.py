"""Ports over pseudo terminals and TCP: opened, drained, lost in any way, reopened."""

import contextlib
import errno
import os
import random
import socket
import time

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from terminals import FakeDevice, until

from hardware_bridge.errors import BridgeError
from hardware_bridge.links.link_state import LATEST, SOONEST, LinkNotice
from hardware_bridge.links.links import Links
from hardware_bridge.links.ports import PortSpec
from hardware_bridge.links.serial_port import SerialPort
from hardware_bridge.links.stream import Stream
from hardware_bridge.recording.format import MOST_PAYLOAD

NOW = time.monotonic_ns


def spec(device, name="links.a", baud=115200):
    return PortSpec(name=name, port=str(getattr(device, "path", device)), baud=baud)


@pytest.fixture
def devices(tmp_path):
    made = [FakeDevice(tmp_path / name) for name in ("a", "b", "c")]
    yield made
    for device in made:
        device.unplug()


@pytest.fixture
def device(devices):
    return devices[0]


def data_of(chunks, name="links.a"):
    return b"".join(c.data for c in chunks if c.link == name)


def test_a_chunk_is_what_is_there_stamped_after_it_was_read(device):
    with Links([spec(device)], NOW) as links:
        assert links.wait(0.0) == []
        before = NOW()
        device.say(b"one line\r\n\x00\xff\x03\x11\x13")
        chunks = until(links, bool)
        assert [c.data for c in chunks] == [b"one line\r\n\x00\xff\x03\x11\x13"]
        assert before <= chunks[0].t_ns <= NOW()
        assert chunks[0].link == "links.a"


def test_no_byte_is_lost_or_doubled_on_three_links_at_once(devices):
    rng = random.Random(4)
    sent = {f"links.{k}": rng.randbytes(60_000) for k in range(3)}
    done = dict.fromkeys(sent, 0)
    specs = [spec(d, name) for d, name in zip(devices, sent, strict=True)]
    with Links(specs, NOW) as links:

        def all_there(chunks):
            for device, name in zip(devices, sent, strict=True):
                piece = sent[name][done[name] : done[name] + rng.randrange(1, 3000)]
                done[name] += device.say(piece) if piece else 0
            return sum(len(c.data) for c in chunks) == 180_000

        chunks = until(links, all_there)
        assert links.wait(0.02) == []
    for name, data in sent.items():
        assert data_of(chunks, name) == data
        stamps = [c.t_ns for c in chunks if c.link == name]
        assert stamps == sorted(stamps)


def test_unplugged_is_noticed_and_plugged_in_again_found(devices):
    specs = [spec(d, f"links.{k}") for k, d in enumerate(devices)]
    with Links(specs, NOW) as links:
        assert [n.up for n in links.drain_notices()] == [True] * 3
        noticed_after = []
        for _ in range(3):
            devices[0].unplug()
            t_ns = NOW()
            until(links, lambda _: not links.is_up("links.0"))
            (notice,) = links.drain_notices()
            assert (notice.link, notice.up) == ("links.0", False)
            assert "unplugged" in notice.reason
            noticed_after.append(notice.t_ns - t_ns)
            assert links.reason("links.0") == notice.reason
            assert not links.send("links.0", b"command")
            devices[1].say(b"still here")
            assert data_of(until(links, bool), "links.1") == b"still here"
            devices[0].plug()
            chunks = until(links, lambda _: links.is_up("links.0"))
            assert not chunks
            ups = [n for n in links.drain_notices() if n.up]
            assert [n.link for n in ups] == ["links.0"]
            assert devices[0].heard() == b""  # nothing is sent automatically
            devices[0].say(b"back")
            assert data_of(until(links, bool), "links.0") == b"back"
        assert min(noticed_after) < 100e6  # documented limit; a busy machine may be late once


def test_what_was_said_before_the_plug_was_pulled_does_not_make_a_loss_unseen(device):
    with Links([spec(device)], NOW) as links:
        device.say(b"last words")
        device.unplug()
        chunks = until(links, lambda _: not links.is_up("links.a"))
        assert data_of(chunks) in (b"last words", b"")  # the kernel may drop them


def test_sends_whole_messages_or_none(device):
    with Links([spec(device)], NOW) as links:
        taken, k = [], 0
        while True:
            message = b"<%06d>" % k + b"." * 400
            k += 1
            if not links.send("links.a", message):
                break
            taken.append(message)
        assert not links.send("links.a", b"too late")
        heard = b""
        expected = b"".join(taken)
        end = time.monotonic() + 10.0
        while len(heard) < len(expected):
            assert time.monotonic() < end
            heard += device.heard()
            links.wait(0.001)
        assert heard == expected
        assert links.send("links.a", b"fresh")
        assert not links.wait(0.01)
        assert device.heard() == b"fresh"


@pytest.mark.parametrize("piece", [10_000, 16_383, 1 << 14])
def test_what_is_read_at_once_fits_a_record(monkeypatch, piece):
    """A port that returns pieces of odd sizes: all live data is in the recording, too."""
    left = 3 * MOST_PAYLOAD

    def read(fd, most):
        nonlocal left
        given = min(piece, most, left)
        left -= given
        if not given:
            raise BlockingIOError
        return bytes(given)

    monkeypatch.setattr(os, "read", read)
    stream = Stream(0, 64)
    sizes = [len(stream.read()) for _ in range(4)]
    assert max(sizes) <= MOST_PAYLOAD
    assert sum(sizes) == 3 * MOST_PAYLOAD


@settings(max_examples=40)
@given(st.lists(st.tuples(st.integers(0, 9000), st.integers(0, 9000)), max_size=30))
def test_a_stream_cuts_no_message_and_keeps_no_second_one(steps):
    import fcntl

    read_end, write_end = os.pipe()
    fcntl.fcntl(write_end, fcntl.F_SETPIPE_SZ, 4096)
    os.set_blocking(read_end, False)
    os.set_blocking(write_end, False)
    stream, taken, heard = Stream(write_end, 64), b"", b""
    for k, (n_write, n_read) in enumerate(steps):
        message = bytes([k]) * n_write
        if stream.write(message):
            taken += message
        if n_read:
            with contextlib.suppress(BlockingIOError):
                heard += os.read(read_end, n_read)
        assert len(taken) - len(heard) <= 4096 + 9000  # the pipe, and one message
    while len(heard) < len(taken):
        stream.flush()
        heard += os.read(read_end, 9000)
    assert heard == taken
    os.close(read_end)
    os.close(write_end)


def test_nothing_is_taken_while_old_bytes_wait_to_leave(device, monkeypatch):
    with Links([spec(device)], NOW) as links:
        monkeypatch.setattr(Stream, "queued", lambda _: 10_000)
        assert not links.send("links.a", b"late")
        monkeypatch.setattr(Stream, "queued", lambda _: 0)
        assert links.send("links.a", b"fresh")
        assert device.heard() == b"fresh"


def test_a_message_cut_by_the_loss_is_not_finished_at_the_next_device(device):
    with Links([spec(device)], NOW) as links:
        while links.send("links.a", b"drive" * 100):
            pass
        device.unplug()
        until(links, lambda _: not links.is_up("links.a"))
        device.plug()
        until(links, lambda _: links.is_up("links.a"))
        links.wait(0.02)
        assert device.heard() == b""


def test_close_gives_the_last_command_its_time(device):
    links = Links([spec(device)], NOW)
    assert links.send("links.a", b"neutral")
    links.close()
    links.close()
    assert not links.is_up("links.a")
    assert not links.send("links.a", b"drive")


def test_a_port_is_one_programs_alone(device):
    first = SerialPort(spec(device))
    try:
        with pytest.raises(BridgeError, match=r"links\.b: .* is in use by another program"):
            Links([spec(device, "links.b")], NOW)
    finally:
        first.close()
    Links([spec(device, "links.b")], NOW).close()


def test_a_missing_port_is_an_error_or_waited_for(tmp_path):
    path = tmp_path / "a"
    with pytest.raises(BridgeError, match=r"links\.a: no port .*relpos doctor"):
        Links([spec(path)], NOW)
    with Links([spec(path)], NOW, wait_for_ports=True) as links:
        (notice,) = links.drain_notices()
        assert not notice.up
        assert notice.reason.startswith("no port ")
        device = FakeDevice(path)
        until(links, lambda _: links.is_up("links.a"))
        assert [n.up for n in links.drain_notices()] == [True]
    device.unplug()


def test_wakes_for_what_the_caller_watches(device):
    ours, theirs = socket.socketpair()
    with ours, theirs, Links([spec(device)], NOW) as links:
        links.watch(ours.fileno())
        theirs.sendall(b"x")
        start = time.monotonic()
        assert links.wait(20.0) == []
        assert time.monotonic() - start < 10.0
        device.say(b"both")
        assert data_of(until(links, bool)) == b"both"
        assert ours.recv(9) == b"x"
        links.unwatch(ours.fileno())


def test_what_is_no_serial_port_is_told(tmp_path):
    plain = tmp_path / "plain"
    plain.write_bytes(b"text")
    for path in (plain, "/dev/null"):
        with pytest.raises(BridgeError, match="is not a serial port"):
            Links([spec(path)], NOW)


def test_no_rate_that_hangs_up(device):
    with pytest.raises(BridgeError, match="baud: expected at least 50, got 0"):
        Links([spec(device, baud=0)], NOW)


def test_two_links_at_one_device_are_refused(device):
    real = os.path.realpath(device.path)
    with pytest.raises(BridgeError, match=r"cars\.1: .* is the port of links\.a too"):
        Links([spec(device), spec(real, "cars.1")], NOW)
    with pytest.raises(BridgeError, match="two ports of this name"):
        Links([spec(device), spec("/dev/else")], NOW)


class FakePort:
    """A pipe with programmable errors of reads and writes."""

    def __init__(self):
        self.read_end, self.write_end = os.pipe()
        os.set_blocking(self.read_end, False)
        self.error = None

    def fileno(self):
        return self.read_end

    def read(self):
        if self.error is not None:
            raise self.error
        return os.read(self.read_end, 4096)

    def write(self, data):
        if self.error is not None:
            raise self.error
        return True

    def flush(self):
        return True

    def close(self, linger=0.0):
        error, self.error = self.error, None
        for fd in (self.read_end, self.write_end):
            os.close(fd)
        if error is not None:
            raise error


def failures():
    import termios

    import serial

    numbers = (errno.EIO, errno.ENXIO, errno.ENODEV, errno.EBADF, errno.EPERM, errno.EPIPE)
    yield from (OSError(n, os.strerror(n)) for n in numbers)
    yield serial.SerialException("device reports readiness to read but returned no data")
    yield serial.SerialException(errno.EIO, "could not open port")
    yield serial.SerialException("read failed: [Errno 5] Input/output error")
    yield serial.PortNotOpenError()
    yield serial.SerialTimeoutException("Write timeout")
    yield termios.error(errno.EIO, "Input/output error")
    yield TypeError("'NoneType' object cannot be interpreted as an integer")
    yield ValueError("file descriptor cannot be a negative integer (-1)")
    yield AttributeError("fd")
    yield ConnectionResetError(errno.ECONNRESET, "Connection reset by peer")


class Shelf:
    """Ports of three links, with programmable errors of opening."""

    def __init__(self):
        self.ports = {}
        self.error = {}

    def open(self, spec):
        if self.error.get(spec.name) is not None:
            raise self.error[spec.name]
        self.ports[spec.name] = FakePort()
        return self.ports[spec.name]


NAMES = ("links.a", "links.b", "cars.1")


@settings(max_examples=25)
@given(
    st.lists(
        st.tuples(
            st.sampled_from(NAMES),
            st.sampled_from(list(failures())),
            st.sampled_from(["read", "write", "open"]),
        ),
        max_size=12,
    )
)
def test_whatever_one_port_does_the_others_go_on(script):
    shelf, clock = Shelf(), [0]
    specs = [PortSpec(name=name, port=f"tcp:{name}:1") for name in NAMES]
    with Links(specs, lambda: clock[0], open_port=shelf.open) as links:
        for victim, error, how in script:
            if links.is_up(victim):
                if how == "open":
                    shelf.error[victim] = error
                shelf.ports[victim].error = error
                if how == "write":
                    assert not links.send(victim, b"x")
                else:
                    os.write(shelf.ports[victim].write_end, b"x")
            for name in NAMES:
                if name != victim and links.is_up(name):
                    os.write(shelf.ports[name].write_end, name.encode())
            chunks = links.wait(0.0)
            assert not links.is_up(victim)
            assert links.reason(victim)
            for name in NAMES:
                if name != victim and links.is_up(name):
                    assert data_of(chunks, name) == name.encode()
                    assert links.send(name, b"y")
        shelf.error.clear()
        clock[0] += LATEST
        until(links, lambda _: all(links.is_up(name) for name in NAMES))


def test_attempts_come_after_a_tenth_of_a_second_and_then_ever_less():
    shelf, clock, attempts = Shelf(), [0], []

    def count(spec):
        attempts.append(clock[0])
        return shelf.open(spec)

    shelf.error["links.a"] = BridgeError("links.a: no port")
    specs = [PortSpec(name="links.a", port="tcp:here:1")]
    with Links(specs, lambda: clock[0], wait_for_ports=True, open_port=count) as links:
        for _ in range(80):
            clock[0] += SOONEST
            links.wait(0.0)
            until(links, lambda _: links._links["links.a"].retry_ns is not None)
        assert links.drain_notices() == [LinkNotice("links.a", 0, up=False, reason="no port")]
    waits = [round((b - a) / 1e9, 1) for a, b in zip(attempts, attempts[1:], strict=False)]
    assert waits == [0.1, 0.2, 0.4, 0.8, 1.6, 2.0, 2.0]


def test_a_port_that_takes_its_time_holds_up_nobody(device):
    import threading

    go = threading.Event()
    shelf = Shelf()

    def slow(spec):
        if spec.name == "links.slow":
            go.wait(20.0)
        return shelf.open(spec)

    def first(spec):
        if spec.name == "links.slow" and not go.is_set() and "tried" not in shelf.error:
            shelf.error["tried"] = None
            raise OSError(errno.ENODEV, "gone")
        return slow(spec)

    specs = [PortSpec(name=n, port=f"tcp:{n}:1") for n in ("links.slow", "links.a")]
    with Links(specs, NOW, wait_for_ports=True, open_port=first) as links:
        end = time.monotonic() + 0.3
        while time.monotonic() < end:  # the retry blocks all this time
            os.write(shelf.ports["links.a"].write_end, b"tick")
            assert data_of(until(links, bool)) == b"tick"
        assert not links.is_up("links.slow")
        go.set()
        until(links, lambda _: links.is_up("links.slow"))


@pytest.fixture
def server():
    with socket.create_server(("127.0.0.1", 0)) as listening:
        yield listening


def test_tcp_speaks_and_is_lost_when_the_other_end_closes(server):
    port = server.getsockname()[1]
    with Links([spec(f"tcp:127.0.0.1:{port}")], NOW) as links:
        peer, _ = server.accept()
        with peer:
            peer.sendall(b"hello")
            assert data_of(until(links, bool)) == b"hello"
            assert links.send("links.a", b"command")
            assert peer.recv(100) == b"command"
        until(links, lambda _: not links.is_up("links.a"))
        assert "other end" in links.reason("links.a")
        until(links, lambda _: links.is_up("links.a"))
        server.accept()[0].close()


def test_tcp_tells_what_is_wrong(server):
    port = server.getsockname()[1]
    server.close()
    with pytest.raises(BridgeError, match=r"cannot connect to 127\.0\.0\.1 port .*program listens"):
        Links([spec(f"tcp:127.0.0.1:{port}")], NOW)
    for bad in ("tcp:host", "tcp::5", "tcp:host:0", "tcp:host:99999", "tcp:host:a"):
        with pytest.raises(BridgeError, match="expected tcp:host:port"):
            Links([spec(bad)], NOW)
