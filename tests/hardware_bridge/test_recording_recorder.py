"""The recorder with a disk that is full, slow or missing, and under SIGKILL."""

import errno
import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hardware_bridge.errors import BridgeError
from hardware_bridge.recording import Header, Kind, Recorder, read_recording
from hardware_bridge.recording.format import OVERHEAD

ROOT = Path(__file__).resolve().parents[2]
HEADER = Header(software="test", config="", links=("links.a",), monotonic_ns=0, wall_ns=0)


class Disk:
    """Disk that accepts `room` bytes and then none; a negative `room` is unlimited."""

    def __init__(self, room=-1):
        self.room = room

    def write(self, fd, data):
        if self.room == 0:
            raise OSError(errno.ENOSPC, "No space left on device")
        n = len(data) if self.room < 0 else min(self.room, len(data))
        self.room -= n if self.room > 0 else 0
        return os.write(fd, data[:n])


def frames(recording):
    return [int(r.payload) for r in recording if r.kind == Kind.BYTES_IN]


def told(recording):
    """Return the numbers of lost records that the recording reports."""
    events = [r.event() for r in recording if r.kind == Kind.EVENT]
    return [e["records"] for e in events if e["event"] == "recording_lost"]


def test_it_starts_only_on_a_new_path(tmp_path):
    path = tmp_path / "a.rec"
    path.write_bytes(b"mine")
    with pytest.raises(BridgeError, match="exists already"):
        Recorder(path, HEADER)
    assert path.read_bytes() == b"mine"
    with pytest.raises(BridgeError, match="cannot be recorded"):
        Recorder(tmp_path / "no" / "a.rec", HEADER)
    with pytest.raises(BridgeError, match="No space left"):
        Recorder(tmp_path / "b.rec", HEADER, write=Disk(10).write)
    assert not (tmp_path / "b.rec").exists()


def test_a_full_disk_is_flagged_and_the_file_ends_whole(tmp_path):
    disk = Disk()
    recorder = Recorder(tmp_path / "a.rec", HEADER, write=disk.write)
    recorder.add(Kind.BYTES_IN, 0, 1, b"0")
    assert recorder.flush()
    disk.room = 2 * (OVERHEAD + 1) + 20
    for k in range(1, 6):
        recorder.add(Kind.BYTES_IN, 0, k, b"%d" % k)
        recorder.flush()
    assert recorder.lost == "No space left on device"
    assert recorder.failing
    assert recorder.dropped == 3
    assert not recorder.close()
    recording = read_recording(tmp_path / "a.rec")
    assert frames(recording) == [0, 1, 2]
    assert (recording.torn, recording.damaged) == (False, 0)


def test_it_goes_on_when_there_is_room_again(tmp_path):
    disk, clock = Disk(), [0.0]
    recorder = Recorder(tmp_path / "a.rec", HEADER, write=disk.write, clock=lambda: clock[0])
    for k in range(20):
        if k == 5:
            disk.room = OVERHEAD + 3
        if k == 10:
            # The disk accepts bytes again, but the next attempt is not due yet.
            disk.room = -1
        if k == 12:
            clock[0] = 100.0
        recorder.add(Kind.BYTES_IN, 0, k, b"%d" % k)
        recorder.flush()
    assert recorder.lost
    assert not recorder.failing
    assert recorder.dropped == 6
    assert not recorder.close()
    recording = read_recording(tmp_path / "a.rec")
    assert frames(recording) == [0, 1, 2, 3, 4, 5, *range(12, 20)]
    assert told(recording) == [6]
    assert (recording.torn, recording.damaged, recording.missing) == (False, 0, 0)


def test_a_slow_disk_costs_records_and_no_time(tmp_path):
    gate, started, first = threading.Event(), threading.Event(), []

    def write(fd, data):
        if first:
            started.set()
            assert gate.wait(30.0)
        first.append(True)
        return os.write(fd, data)

    recorder = Recorder(tmp_path / "a.rec", HEADER, most_waiting=10 * (OVERHEAD + 2), write=write)
    recorder.add(Kind.BYTES_IN, 0, 0, b"10")
    assert started.wait(30.0)
    for k in range(11, 31):
        recorder.add(Kind.BYTES_IN, 0, k, b"%d" % k)
    assert recorder.lost == "the disk is too slow"
    assert recorder.dropped == 11
    assert not recorder.flush(timeout=0.0)
    assert not recorder.close(timeout=0.0)
    recorder.add(Kind.BYTES_IN, 0, 50, b"50")
    gate.set()
    assert not recorder.close(timeout=30.0)
    recording = read_recording(tmp_path / "a.rec")
    assert frames(recording) == list(range(10, 20))
    assert told(recording) == [11]


def test_what_is_no_record_is_refused_and_the_rest_goes_on(tmp_path):
    recorder = Recorder(tmp_path / "a.rec", HEADER)
    recorder.add(Kind.BYTES_IN, 70000, 0, b"1")
    recorder.add(Kind.BYTES_IN, 0, 2**70, b"1")
    recorder.add(Kind.BYTES_IN, 0, 0, bytes(1 << 17))
    recorder.add(Kind.BYTES_IN, 0, 0, "text")
    recorder.add(Kind.BYTES_IN, None, 0, b"1")
    recorder.add(Kind.HEADER, 0, 0, b"{}")
    recorder.add(99, 0, 0, b"")
    recorder.add(Kind.BYTES_IN, 0, 0, bytearray(b"7"))
    recorder.add_event(5, "link_down", link="links.a", odd={1})
    assert not recorder.close()
    assert recorder.dropped == 7
    recording = read_recording(tmp_path / "a.rec")
    assert frames(recording) == [7]
    assert sum(told(recording)) == 6  # all except the one without a valid time
    *_, last = recording
    assert last.event() == {"event": "link_down", "link": "links.a", "odd": "{1}"}


def test_a_sync_that_fails_is_flagged_and_one_that_cannot_be_is_not(tmp_path, monkeypatch):
    failures = iter([errno.EINVAL, errno.EIO])
    for name, flagged in (("a.rec", None), ("b.rec", os.strerror(errno.EIO))):
        number = next(failures)

        def fail(fd, number=number):
            raise OSError(number, os.strerror(number))

        monkeypatch.setattr(os, "fsync", fail)
        recorder = Recorder(tmp_path / name, HEADER)
        recorder.add(Kind.TICK, 0, 0)
        assert recorder.flush()
        assert recorder.close() == (flagged is None)
        assert recorder.lost == flagged
        assert recorder.dropped == 0


def test_records_are_written_while_a_sync_hangs(tmp_path, monkeypatch):
    gate, hangs = threading.Event(), threading.Event()

    def hang(fd):
        hangs.set()
        assert gate.wait(30.0)

    monkeypatch.setattr(os, "fsync", hang)
    recorder = Recorder(tmp_path / "a.rec", HEADER)
    assert hangs.wait(30.0)
    recorder.add(Kind.BYTES_IN, 0, 0, b"1")
    assert recorder.flush()
    assert frames(read_recording(tmp_path / "a.rec")) == [1]
    assert not recorder.close(timeout=0.0)
    gate.set()
    assert recorder.close(30.0)


def test_a_mistake_in_the_thread_is_a_lost_recording(tmp_path):
    calls = []

    def write(fd, data):
        calls.append(1)
        if len(calls) > 1:
            raise RuntimeError("a mistake")
        return os.write(fd, data)

    recorder = Recorder(tmp_path / "a.rec", HEADER, write=write)
    recorder.add(Kind.TICK, 0, 0)
    assert not recorder.flush(30.0)
    assert "a mistake" in recorder.lost
    recorder.add(Kind.TICK, 0, 1)
    assert recorder.dropped == 2
    assert not recorder.close()


@settings(max_examples=60)
@given(
    st.lists(
        st.tuples(
            st.integers(0, 4),
            st.sampled_from([-1, -1, 0, 1, 40, 100]),
            st.floats(0.0, 2.0),
            st.booleans(),
        ),
        max_size=12,
    )
)
def test_every_record_is_in_the_file_or_counted(tmp_path_factory, steps):
    """Holds for any errors of the disk, and whether or not the file can be truncated."""
    path = tmp_path_factory.mktemp("r") / "a.rec"
    disk, clock, n = Disk(), [0.0], 0
    truncate = os.ftruncate

    def fail(fd, size):
        raise OSError(errno.EIO, "Input/output error")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "fsync", lambda fd: None)
        recorder = Recorder(path, HEADER, write=disk.write, clock=lambda: clock[0])
        for count, room, passed, can_cut in steps:
            disk.room, clock[0] = room, clock[0] + passed
            patch.setattr(os, "ftruncate", truncate if can_cut else fail)
            for _ in range(count):
                recorder.add(Kind.BYTES_IN, 0, n, b"%d" % n)
                n += 1
            recorder.flush()
        disk.room = -1
        closed_well = recorder.close()
    recording = read_recording(path)
    found = frames(recording)
    assert found == sorted(set(found))
    # With space at the end, the file itself reports all missing records.
    assert len(found) + sum(told(recording)) == n
    assert sum(told(recording)) == recorder.dropped
    assert closed_well == (recorder.dropped == 0) == (recorder.lost is None)
    assert not recording.torn


KILLED = """
import sys
from hardware_bridge.recording import Header, Kind, Recorder
header = Header(software="t", config="", links=("links.a",), monotonic_ns=0, wall_ns=0)
recorder = Recorder(sys.argv[1], header)
k = 0
while True:
    for _ in range(50):
        recorder.add(Kind.BYTES_IN, 0, k, b"%d" % k)
        k += 1
    assert recorder.flush()
    print(k, flush=True)
"""


def test_sigkill_costs_nothing_that_was_acknowledged(tmp_path):
    path = tmp_path / "a.rec"
    process = subprocess.Popen(
        [sys.executable, "-c", KILLED, str(path)], stdout=subprocess.PIPE, cwd=ROOT
    )
    with process:
        for _ in range(20):
            acknowledged = int(process.stdout.readline())
        process.send_signal(signal.SIGKILL)
        acknowledged = max([acknowledged, *map(int, process.stdout.read().split())])
    recording = read_recording(path)
    assert frames(recording)[:acknowledged] == list(range(acknowledged))
    assert recording.damaged == recording.missing == 0
    data = path.read_bytes()
    path.write_bytes(data[:-3])
    assert read_recording(path).torn


LIMITED = """
import resource, sys
from hardware_bridge.recording import Header, Kind, Recorder
header = Header(software="t", config="", links=("links.a",), monotonic_ns=0, wall_ns=0)
resource.setrlimit(resource.RLIMIT_FSIZE, (5000, 5000))
recorder = Recorder(sys.argv[1], header)
for k in range(1000):
    recorder.add(Kind.BYTES_IN, 0, k, b"%d" % k)
    if k % 50 == 0:
        recorder.flush()
recorder.close()
print(recorder.dropped, recorder.lost)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="limits of POSIX")
def test_a_file_that_the_system_lets_grow_no_more(tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", LIMITED, str(tmp_path / "a.rec")],
        capture_output=True,
        text=True,
        check=True,
        cwd=ROOT,
    )
    dropped, reason = done.stdout.strip().split(" ", 1)
    assert reason == os.strerror(errno.EFBIG)
    recording = read_recording(tmp_path / "a.rec")
    assert frames(recording) == list(range(1000 - int(dropped)))
    assert (tmp_path / "a.rec").stat().st_size <= 5000
    assert not recording.torn
