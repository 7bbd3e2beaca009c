"""Real processes at real pseudo terminals that are hung, stopped, killed, unplugged or silent, or
have a full disk. Times are those at which the cars receive commands."""

import os
import signal
import time

import pytest
from rows import MS, Drive, Emulation

from hardware_bridge.recording import Kind, read_recording

pytestmark = [pytest.mark.slow, pytest.mark.realtime]
SECOND = 1_000_000_000
CARS = range(3)


class Garage:
    """One emulation, and one drive at a time on it."""

    def __init__(self, folder):
        self.folder, self._n, self.drive = folder, 0, None
        self.emulation = Emulation(folder / "emulation", scenario="cars-nlos", seed=3, seconds=900)

    def driven(self):
        """Return emulation and drive once the cars have been armed for a while."""
        if self.drive is None or self.drive.process.poll() is not None:
            self.end()
            self._n += 1
            record = self.folder / f"{self._n}.relpos"
            self.drive = Drive(self.emulation.config, record=str(record))
            self.drive.record = record
            self.drive.moving()
        now = self.drive.wait_for(lambda s: "armed" in s, since=time.monotonic_ns())
        if not all(now["armed"]):
            self.drive.arm()
        start = time.monotonic_ns()
        self.drive.wait_for(lambda s: "armed" in s, since=start + SECOND // 3)
        assert not brakes(self.emulation, start, time.monotonic_ns())
        return self.emulation, self.drive

    def end(self):
        if self.drive is not None:
            self.drive.close()

    def close(self):
        self.end()
        self.emulation.close()


@pytest.fixture(scope="module")
def garage(tmp_path_factory):
    garage = Garage(tmp_path_factory.mktemp("rows"))
    yield garage
    garage.close()


@pytest.fixture(scope="module")
def figures():
    """Collect the measurements and print them, for display with -s."""
    told = []
    yield told
    print()
    for line in told:
        print(line)


def brakes(emulation, start, end, cars=CARS):
    """Return the stop commands between two times."""
    return [c for k in cars for c in emulation.commands(k, start, end) if c[1]]


def drives(emulation, start, end, cars=CARS):
    """Return the commands other than stop between two times."""
    return [c for k in cars for c in emulation.commands(k, start, end) if not c[1]]


def longest_gap(emulation, car, start, end):
    """Return the longest time between two commands to a car [ms]."""
    times = [start, *(c[0] for c in emulation.commands(car, start, end)), end]
    return max(b - a for a, b in zip(times, times[1:], strict=False)) / MS


def best(figures, name, limit, measure, tries=3):
    """Measure until within the limit; other programs may have used the processor."""
    measured = []
    for _ in range(tries):
        measured.append(measure())
        if measured[-1] <= limit:
            break
    figures.append(f"{name}: {', '.join(f'{m:.1f}' for m in measured)} ms, limit {limit:g}")
    assert min(measured) <= limit, measured


def hang(drive):
    return drive.wait_for(lambda s: "hangs" in s, since=drive.tell(hang=0.6))["t_ns"]


def freeze(drive):
    return drive.signal(signal.SIGSTOP)


@pytest.mark.parametrize("begin", [hang, freeze])
def test_hung_or_stopped(garage, figures, begin):
    def measure():
        emulation, drive = garage.driven()
        start = begin(drive)
        time.sleep(0.6)
        drive.signal(signal.SIGCONT)
        back = time.monotonic_ns()
        heard = emulation.first_brake(start)
        # After resuming, the process moves no car by itself.
        drive.wait_for(lambda s: "armed" in s, since=back + SECOND)
        assert drives(emulation, back, back + SECOND) == []
        assert max(emulation.motors(heard + 20 * MS, back + SECOND)) == 0.0
        return (heard - start) / MS

    best(figures, f"neutral after the policy was {begin.__name__}", 100.0, measure)


def test_killed(garage, figures):
    def measure():
        emulation, drive = garage.driven()
        start = drive.signal(signal.SIGKILL)
        time.sleep(0.8)
        heard = emulation.first_brake(start)
        assert drives(emulation, heard + 1, time.monotonic_ns()) == []
        assert ends(drive.supervisor)
        check_recording(emulation, drive, start, figures)
        return (heard - start) / MS

    best(figures, "neutral after the policy was killed", 100.0, measure)


def test_closed_terminal(garage, figures):
    """SIGHUP and SIGINT of the terminal affect the deciding process only."""

    def measure():
        emulation, drive = garage.driven()
        assert os.getsid(drive.supervisor) == drive.supervisor
        for stray in (signal.SIGHUP, signal.SIGINT):
            os.kill(drive.supervisor, stray)
        start = drive.signal(signal.SIGHUP)
        time.sleep(0.8)
        heard = emulation.first_brake(start)
        assert drives(emulation, heard + 1, time.monotonic_ns()) == []
        assert ends(drive.supervisor)
        return (heard - start) / MS

    best(figures, "neutral after the terminal was closed", 100.0, measure)


def test_supervisor_told_to_end(garage, figures):
    def measure():
        emulation, drive = garage.driven()
        start = time.monotonic_ns()
        os.kill(drive.supervisor, signal.SIGTERM)
        time.sleep(0.8)
        heard = emulation.first_brake(start)
        assert drives(emulation, heard + 1, time.monotonic_ns()) == []
        assert ends(drive.supervisor)
        drive.process.wait(10.0)
        return (heard - start) / MS

    best(figures, "neutral after the supervisor was told to end", 100.0, measure)


def ends(pid, within=5.0):
    """Return whether a process ends; the time does not matter once the cars are stopped."""
    until = time.monotonic() + within
    while running(pid) and time.monotonic() < until:
        time.sleep(0.02)
    return not running(pid)


def running(pid):
    """Return whether a process exists and is not a zombie."""
    try:
        with open(f"/proc/{pid}/stat") as file:
            return file.read().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


def check_recording(emulation, drive, killed_ns, figures):
    """Check that the file holds all received bytes until shortly before the end."""
    recording = read_recording(drive.record)
    assert recording.damaged == 0
    assert recording.missing == 0
    last = killed_ns - recording.t_range_ns[1]
    figures.append(f"recording ends {last / MS:.1f} ms before SIGKILL, torn {recording.torn}")
    assert last < 150 * MS
    heard = {name: b"" for name in recording.header.links}
    for record in recording:
        if record.kind == Kind.BYTES_IN:
            heard[recording.header.links[record.link]] += record.payload
    for k in CARS:
        said = (emulation.folder / "said" / f"n{k + 1}").read_bytes()
        assert len(heard[f"links.n{k + 1}"]) > 10_000
        assert heard[f"links.n{k + 1}"] in said


def test_supervisor_killed(garage, figures):
    def measure():
        emulation, drive = garage.driven()
        turning = time.monotonic() + 20.0
        while not all(emulation.steps[-1]["motor"]):
            assert time.monotonic() < turning
            time.sleep(0.01)
        os.kill(drive.supervisor, signal.SIGKILL)
        start = time.monotonic_ns()
        said = drive.wait_for(lambda s: "error" in s, since=start)
        assert said["error"].startswith("supervisor: it is gone")
        assert drive.process.wait(10.0) == 2
        time.sleep(0.5)
        stopped = emulation.last_turn(start)
        assert max(emulation.motors(stopped + 1, time.monotonic_ns())) == 0.0
        figures.append(f"supervisor gone: told after {(said['t_ns'] - start) / MS:.1f} ms")
        return (stopped - start) / MS

    # The emulated controller acts every 10 ms.
    best(figures, "motors stand by their own deadman after the supervisor was killed", 210.0,
         measure)  # fmt: skip


def test_silent_node(garage, figures):
    emulation, drive = garage.driven()
    start = emulation.befall("silence", "nodes.1", 1.0)
    slow = drive.wait_for(lambda s: "cap" in s and s["cap"][0] <= 0.3, since=start + 100 * MS)
    stopped = drive.wait_for(lambda s: "armed" in s and not s["armed"][0], since=start)
    assert stopped["reason"][0] == "no message from its node, or no estimate"
    time.sleep(2.0)
    now = time.monotonic_ns()
    first = min(c[0] for c in brakes(emulation, start, now, [0]))
    age = (first - start) / MS
    figures.append(f"stale: slow seen after {(slow['t_ns'] - start) / MS:.0f} ms, brake {age:.0f}")
    assert 290.0 <= age <= 450.0
    fast = [c for c in drives(emulation, start + 250 * MS, now, [0]) if abs(c[2]) > 0.301]
    assert fast == []
    # The node has sent again for a second, and the car does not move.
    assert drives(emulation, first + 1, now, [0]) == []
    # An arm order before the car was healthy for long enough is refused.
    start = emulation.befall("silence", "nodes.1", 0.5)
    drive.wait_for(lambda s: "armed" in s, since=start + 600 * MS)
    early = drive.tell(order="arm")
    refusal = drive.wait_for(lambda s: "cars.1 not armed" in s.get("notice", ""), since=early)
    assert "all must be well for 0.5 s" in refusal["notice"]
    assert drives(emulation, start, time.monotonic_ns(), [0]) == []
    drive.arm()
    time.sleep(0.2)
    assert drives(emulation, early, time.monotonic_ns(), [0])


def notice(drive, text, since, seconds=10.0):
    """Return the time of a notice [ns]."""
    return drive.wait_for(lambda s: s.get("notice", "").startswith(text), seconds, since)["at_ns"]


def test_unplugged_car(garage, figures):
    def measure():
        emulation, drive = garage.driven()
        start = emulation.befall("unplug", "cars.1", 1.0)
        down = notice(drive, "cars.1 down", start)
        up = notice(drive, "cars.1 up", start)
        time.sleep(1.0)
        now = time.monotonic_ns()
        for car in (1, 2):
            assert brakes(emulation, start, now, [car]) == []
            gap = longest_gap(emulation, car, start, now)
            figures.append(f"unplugged car 1: longest gap of car {car + 1} {gap:.0f} ms")
            assert gap < 150.0
        assert drives(emulation, start + 20 * MS, now, [0]) == []
        assert brakes(emulation, up, now, [0])
        figures.append(f"unplugged car: back after {(up - start) / MS:.0f} ms of 1000")
        assert up - start < 3 * SECOND
        return (down - start) / MS

    best(figures, "unplugged car noticed after", 100.0, measure)


def test_unplugged_node(garage, figures):
    def measure():
        emulation, drive = garage.driven()
        start = emulation.befall("unplug", "nodes.1", 1.0)
        down = notice(drive, "links.n1 down", start)
        up = notice(drive, "links.n1 up", start)
        time.sleep(1.0)
        now = time.monotonic_ns()
        stood = emulation.first_brake(start, [0])
        figures.append(f"unplugged node: car stands after {(stood - start) / MS:.0f} ms")
        assert stood - start < 450 * MS
        assert drives(emulation, stood + 1, now, [0]) == []
        for car in CARS:
            assert longest_gap(emulation, car, start, now) < 150.0
        assert up - start < 3 * SECOND
        return (down - start) / MS

    best(figures, "unplugged node noticed after", 100.0, measure)


def test_full_disk(garage, figures):
    emulation, drive = garage.driven()
    size = drive.record.stat().st_size
    start = drive.tell(disk=size + 4096)
    told = notice(drive, "recording fails", start)
    full = drive.record.stat().st_size
    time.sleep(1.5)
    now = time.monotonic_ns()
    assert drive.record.stat().st_size <= full
    assert brakes(emulation, start, now) == []
    gaps = [longest_gap(emulation, car, start, now) for car in CARS]
    figures.append(
        f"full disk: longest gap {max(gaps):.0f} ms, told after {(told - start) / MS:.0f} ms"
    )
    assert max(gaps) < 150.0
    freed = drive.tell(disk=-1)
    time.sleep(2.5)
    end = drive.signal(signal.SIGKILL)
    drive.process.wait()
    recording = read_recording(drive.record)
    assert recording.damaged == 0
    assert recording.missing == 0
    events = [(r.t_ns, r.event()) for r in recording if r.kind == Kind.EVENT]
    lost = [(t, e) for t, e in events if e["event"] == "recording_lost"]
    assert lost
    assert all(start < t < freed + 1.5 * SECOND for t, _ in lost)
    assert sum(e["records"] for _, e in lost) > 100
    assert end - recording.t_range_ns[1] < 150 * MS
