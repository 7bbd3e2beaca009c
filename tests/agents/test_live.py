"""Live tracking over pseudo terminals: a replay equals the live run, also after SIGKILL."""

import io
import json
import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from click.testing import CliRunner
from recorded_runs import same_bits

from agents.cli.main import cli
from agents.errors import UsageError
from agents.hardware.emulate import EmulatedRig, EmulateOptions
from agents.hardware.emulate.rig import STEP_NS
from agents.hardware.live import live
from agents.hardware.live.rates import Rates
from agents.hardware.live.screen import LiveTable
from agents.hardware.live.text import line, node_rows, pair_header, pair_rows
from agents.hardware.replay import replay
from hardware_bridge.emulator.fault_plan import Fault, FaultPlan
from hardware_bridge.emulator.faults import FaultParams
from hardware_bridge.errors import BridgeError
from tracking.measurements import Kind, MeasurementBlock


class RunningRig:
    """An emulation stepped in real time by a thread."""

    def __init__(self, folder, **options):
        self.rig = EmulatedRig(EmulateOptions(**options), folder)
        self.config = folder / "swarm.toml"
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run)

    def _run(self):
        due = time.monotonic_ns()
        while not self._over.is_set():
            due = max(due + STEP_NS, time.monotonic_ns() - 10 * STEP_NS)
            self._over.wait(max(0, due - time.monotonic_ns()) * 1e-9)
            self.rig.step(time.monotonic_ns())

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._over.set()
        self._thread.join()
        self.rig.close()


FAULTS = FaultPlan(
    frames=FaultParams(loss=0.05, duplication=0.05, corruption=0.02, reordering=0.02),
    faults=tuple(
        Fault(t=t, kind=kind, target=target, seconds=0.3)
        for k in range(10)
        for t, kind, target in (
            (1.0 + 2 * k, "unplug", "nodes.1"),
            (1.5 + 2 * k, "reboot", "nodes.2"),
        )
    ),
)


def test_replay_is_live_over_ports_that_come_and_go(tmp_path):
    seen, told = [], []

    def watch(monitor, notices):
        seen.append(monitor.t_ns)
        told.extend(text for _, text in notices)
        # Until a port has gone and come back, on machines of any speed.
        back = "links.n1 up" in told[3:]
        return not (len(seen) >= 25 and back and any("down" in text for text in told))

    with RunningRig(tmp_path / "e", seed=3, faults=FAULTS) as running:
        result = live(running.config, seconds=20.0, record=tmp_path / "a.rec", watch=watch)
    assert result.recording_lost is None
    assert result.decisions == len(seen) == len(result.t_ns)
    assert [text for _, text in result.notices] == told
    assert result.counts["measurements"]["range"] > 50
    assert json.dumps(result.summary, allow_nan=False)
    again = replay(tmp_path / "a.rec")
    np.testing.assert_array_equal(again.t_ns, result.t_ns)
    same_bits(again.estimate, result.estimate)
    assert again.counts == result.counts
    assert again.streams == result.streams
    assert again.notices == result.notices
    assert again.flaws == []


def test_a_process_that_was_killed_leaves_all_but_its_last_moment(tmp_path):
    file = tmp_path / "a.rec"
    code = "from agents.cli.main import main; main()"
    with RunningRig(tmp_path / "e", seed=3) as running:
        args = ["live", "--config", str(running.config), "--record", str(file), "--json"]
        process = subprocess.Popen(
            [sys.executable, "-c", code, *args], stdout=subprocess.PIPE, text=True
        )
        lines = []
        for text in process.stdout:
            lines.append(text)
            if len(lines) >= 75:
                break
        os.kill(process.pid, signal.SIGKILL)
        lines += process.stdout.readlines()
        process.stdout.close()
        assert process.wait() == -signal.SIGKILL
    if not lines[-1].endswith("\n"):
        lines.pop()
    shown = [json.loads(text) for text in lines]
    shown = [record for record in shown if record["result"] == "pair"]
    again = []

    def watch(monitor, notices):
        again.extend(json.loads(json.dumps(monitor.snapshot().pair_records)))

    replay(file, watch=watch)
    n = min(len(shown), len(again))
    # The writer may be a few steps behind on a busy machine.
    assert n >= len(shown) - 3 * 10
    assert again[:n] == shown[:n]
    assert any(record["distance"] is not None for record in shown[:n])


def test_what_cannot_be_listened_to(tmp_path):
    with pytest.raises(BridgeError, match=r"none\.toml"):
        live(tmp_path / "none.toml")
    with pytest.raises(UsageError, match="seconds"):
        live(tmp_path / "none.toml", seconds=0.0)
    rig = EmulatedRig(EmulateOptions(seed=3), tmp_path / "e")
    rig.close()
    done = CliRunner().invoke(cli, ["live", "--config", str(tmp_path / "e" / "swarm.toml")])
    assert isinstance(done.exception, BridgeError)
    assert "links.n1" in str(done.exception)


@pytest.fixture(scope="module")
def snapshots(tmp_path_factory):
    """Return the last monitor and all snapshots of a run in memory."""
    from recorded_runs import run_live

    run = run_live(tmp_path_factory.mktemp("run"), EmulateOptions(scenario="cars-los", seed=3), 60)
    monitors, taken = [], []

    def watch(monitor, notices):
        monitors.append(monitor)
        taken.append(monitor.snapshot())

    result = replay(run.path, watch=watch)
    return monitors[-1], taken, result


def test_what_is_known_at_one_moment(snapshots):
    _, taken, result = snapshots
    last = taken[-1]
    assert [n.node for n in last.nodes] == [1, 2, 3]
    assert all(n.imu_hz == pytest.approx(100.0, abs=5.0) for n in last.nodes)
    assert all(n.range_hz > 20.0 for n in last.nodes)
    assert all(n.message_age < 0.2 for n in last.nodes)
    carried = result.estimate.at(result.t_ns * 1e-9 - result.recording.header.monotonic_ns * 1e-9)
    for p, pair in enumerate(last.pairs):
        np.testing.assert_allclose(pair.pos_w, carried.pos_ij_w[-1, p], atol=1e-12)
        heading = last.nodes[p // 2].heading
        ahead = np.array([np.cos(heading), np.sin(heading)])
        assert pair.forward == pytest.approx(ahead @ pair.pos_w[:2])
        assert pair.left == pytest.approx(ahead[0] * pair.pos_w[1] - ahead[1] * pair.pos_w[0])
        assert pair.std >= np.sqrt(max(pair.cov_w[:2])) - 1e-12
        assert pair.age == pytest.approx(carried.age[-1, p])
        assert pair.up is None
    assert taken[0].pairs[0].distance is None


def test_what_is_shown(snapshots, monkeypatch):
    from rich.console import Console

    monitor, taken, _ = snapshots
    assert [row[0] for row in node_rows(taken[-1])] == ["1", "2", "3"]
    assert [len(row) for row in pair_rows(taken[-1])] == [len(pair_header(taken[-1]))] * 3
    assert pair_rows(taken[0])[0][1:4] == ["-", "-", "-"]
    assert "3 of 3 nodes active" in line(taken[-1])
    out = io.StringIO()
    console = Console(file=out, force_terminal=True, width=120)
    monkeypatch.setattr("rich.live.get_console", lambda: console)
    with LiveTable("three [cars]") as screen:
        screen.show(monitor, [(1.0, "links.n1 down: [unplugged]")])
    shown = out.getvalue()
    for text in ("three [cars]", "links.n1 down: [unplugged]", "1-2", "NLOS", "last message"):
        assert text in shown


def test_rates():
    rates = Rates(3)
    for k in range(50):
        n = 10 if k else 500  # a first step may bring many events at once
        block = MeasurementBlock.of_kind(Kind.IMU, np.zeros(n), np.full(n, 1), np.zeros((n, 6)))
        rates.take(block)
        ends = np.zeros(5, dtype=np.int64), np.full(5, 2)
        ranges = MeasurementBlock.of_kind(
            Kind.RANGE, np.zeros(5), ends[0], np.ones((5, 1)), j=ends[1], antennas=ends
        )
        rates.take(ranges)
        rates.close(0.1 * k)
    np.testing.assert_allclose(rates.hz, [[0, 100, 0], [50, 0, 50]], rtol=1e-6)
    assert rates.totals == {"imu": 500 + 490, "mag": 0, "state": 0, "range": 250}
    assert (Rates(2).hz == 0.0).all()
