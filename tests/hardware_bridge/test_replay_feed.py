"""Invariant: a replay gives the live estimates to the last bit, with any faults."""

import errno
import os
from dataclasses import replace

import numpy as np
import pytest
from recorded_runs import run_live, same_bits

from agents.hardware.emulate import EmulateOptions
from agents.hardware.live.history import History
from hardware_bridge.emulator.fault_plan import Fault, FaultPlan
from hardware_bridge.emulator.faults import FaultParams
from hardware_bridge.errors import BridgeError
from hardware_bridge.live.replay import ReplayFeed, open_replay
from hardware_bridge.recording import Header, Kind, Recorder, read_recording
from tracking.calibration.calibration import Calibration, NodeCalibration, RangeCalibration
from tracking.calibration.file import calibration_toml
from tracking.errors import ConfigError

FRAMES = FaultParams(
    loss=0.1, corruption=0.05, truncation=0.02, duplication=0.1, reordering=0.05, delay=0.01,
    delay_spread=0.01,
)  # fmt: skip
SCRIPT = (
    Fault(t=1.0, kind="unplug", target="nodes.1", seconds=0.6),
    Fault(t=1.5, kind="reboot", target="nodes.2", seconds=0.3),
    Fault(t=2.0, kind="duplicate-id", target="nodes.3", seconds=0.5),
    Fault(t=2.5, kind="clock-step", target="nodes.1", seconds=5.0),
    Fault(t=2.5, kind="stuck-sensor", target="nodes.2", seconds=0.5),
    Fault(t=3.0, kind="unplug", target="nodes.2", seconds=5.5),
)
CALIBRATION = Calibration(
    nodes={1: NodeCalibration(gyr_offset=(0.01, -0.02, 0.005), mag_offset=(3.0, -2.0, 1.0))},
    ranges=RangeCalibration(slope=1.01, offset={1: 0.05, 2: -0.03, 3: 0.02}),
)


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    """Return a run without faults, for tests that only read its recording."""
    return run_live(tmp_path_factory.mktemp("plain"), EmulateOptions(seed=3), 40)


def again(feed: ReplayFeed):
    """Return estimates, times and views of all control steps of a recording."""
    history, views = History(feed.config.constellation), []
    while (t_ns := feed.advance()) is not None:
        feed.swarm.step(t_ns)
        history.add(t_ns, feed.swarm.estimate)
        views.append([array.copy() for array in feed.swarm.view])
    return history, views


@pytest.mark.parametrize(
    ("faults", "format", "decisions"),
    [
        (FaultPlan(), "relpos", 45),
        (FaultPlan(frames=FRAMES, faults=SCRIPT), "relpos", 90),
        (FaultPlan(frames=FRAMES), "dw1000", 45),
    ],
)
def test_replay_is_live(tmp_path, faults, format, decisions):
    options = EmulateOptions(seed=3, seconds=20.0, faults=faults, format=format)
    run = run_live(tmp_path, options, decisions)
    assert run.recorder.lost is None
    if faults.faults:
        assert len(run.rig.emulator.happened) == len(SCRIPT)
        assert {"duplicate", "duplicate_id"} <= run.refused.keys()
    feed = open_replay(run.path)
    history, views = again(feed)
    np.testing.assert_array_equal(history.t_ns, run.t_ns)
    same_bits(history.estimate, run.estimate)
    assert (run.estimate.status > 1).any()
    assert feed.swarm.intake.refused == run.refused
    assert feed.notices == run.notices
    for here, there in zip(views, run.views, strict=True):
        for a, b in zip(here, there, strict=True):
            assert a.tobytes() == b.tobytes()
    same_bits(again(open_replay(run.path))[0].estimate, run.estimate)


def test_how_the_bytes_were_cut_changes_nothing(tmp_path):
    options = EmulateOptions(seed=3, seconds=20.0, faults=FaultPlan(frames=FRAMES))
    run = run_live(tmp_path, options, 40)
    read, rng = read_recording(run.path), np.random.default_rng(0)
    cut = Recorder(tmp_path / "cut.rec", read.header)
    for record in read:
        pieces = [record.payload]
        if record.kind == Kind.BYTES_IN:
            at = np.sort(rng.integers(0, len(record.payload), 4))
            pieces = [bytes(p) for p in np.split(np.frombuffer(record.payload, np.uint8), at)]
        for piece in pieces:
            cut.add(record.kind, record.link, record.t_ns, piece)
    assert cut.close()
    assert read_recording(tmp_path / "cut.rec").n_records > read.n_records
    same_bits(again(open_replay(tmp_path / "cut.rec"))[0].estimate, run.estimate)


def test_the_calibration_is_in_the_recording(tmp_path):
    def edit(text):
        (tmp_path / "e" / "own.toml").write_text(calibration_toml(CALIBRATION))
        return text.replace("uncalibrated = true", 'files = ["own.toml"]')

    run = run_live(tmp_path, EmulateOptions(seed=3), 40, edit=edit)
    (tmp_path / "e" / "own.toml").unlink()
    feed = open_replay(run.path)
    assert feed.calibration == CALIBRATION
    same_bits(again(feed)[0].estimate, run.estimate)
    # Without the calibration the estimates would differ, so the replay is refused.
    data = run.path.read_bytes()
    at = data.index(b"gyr_offset", data.index(b'"calibration"'))
    (tmp_path / "bad.rec").write_bytes(data[:at] + b"X" + data[at + 1 :])
    with pytest.raises(BridgeError, match=r"bad\.rec: the calibration in it is lost"):
        open_replay(tmp_path / "bad.rec")


def test_a_full_disk_is_flagged_and_changes_nothing(tmp_path, plain):
    room = 120_000
    written = 0

    def write(fd, data):
        nonlocal written
        if written + len(data) > room:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        written += len(data)
        return os.write(fd, data)

    full = run_live(tmp_path, EmulateOptions(seed=3), 40, write=write)
    same_bits(full.estimate, plain.estimate)
    np.testing.assert_array_equal(full.t_ns, plain.t_ns)
    assert full.recorder.lost == os.strerror(errno.ENOSPC)
    told = [text for _, text in full.notices if "recording fails" in text]
    assert len(told) == 1
    history, _ = again(open_replay(full.path))
    n = len(history.t_ns)
    assert 5 < n < 40
    np.testing.assert_array_equal(history.t_ns, plain.t_ns[:n])
    same_bits(history.estimate, plain.estimate, n)


def test_a_torn_recording_gives_all_until_there(tmp_path, plain):
    data = plain.path.read_bytes()
    (tmp_path / "torn.rec").write_bytes(data[: len(data) * 2 // 3])
    feed = open_replay(tmp_path / "torn.rec")
    assert feed.recording.torn
    history, _ = again(feed)
    n = len(history.t_ns)
    assert 20 <= n <= 35
    np.testing.assert_array_equal(history.t_ns, plain.t_ns[:n])
    same_bits(history.estimate, plain.estimate, n)


def test_a_damaged_recording_is_used_as_far_as_it_goes(tmp_path, plain):
    data = bytearray(plain.path.read_bytes())
    rng = np.random.default_rng(1)
    for at in rng.integers(len(data) // 10, len(data), 40):
        data[at] ^= 0xFF
    (tmp_path / "bad.rec").write_bytes(data)
    feed = open_replay(tmp_path / "bad.rec")
    assert feed.recording.damaged > 20
    history, _ = again(feed)
    assert 25 <= len(history.t_ns) <= 40
    assert set(history.t_ns) <= set(plain.t_ns)
    assert np.isfinite(history.estimate.pos_ij_w).all()


def test_another_filter(tmp_path, plain):
    same_bits(again(open_replay(plain.path, filter="joint"))[0].estimate, plain.estimate)
    other = again(open_replay(plain.path, filter="ekf"))[0].estimate
    assert not np.array_equal(other.pos_ij_w, plain.estimate.pos_ij_w)
    with pytest.raises(ConfigError, match="filter"):
        open_replay(plain.path, filter="magic")


def test_what_is_no_recording_of_a_swarm_is_refused(tmp_path, plain):
    header = read_recording(plain.path).header
    for name, changed, match in (
        ("a.rec", replace(header, config="name = 3"), r"a\.rec"),
        ("b.rec", replace(header, links=header.links[:1]), "no stream links"),
    ):
        Recorder(tmp_path / name, changed).close()
        with pytest.raises(BridgeError, match=match):
            open_replay(tmp_path / name)


def test_streams_that_nobody_knows_are_passed_over(tmp_path, plain):
    read = read_recording(plain.path)
    more = Recorder(tmp_path / "more.rec", replace(read.header, links=(*read.header.links, "x")))
    for record in read:
        more.add(Kind.BYTES_IN, len(read.header.links), record.t_ns, b"?")
        more.add(record.kind, record.link, record.t_ns, record.payload)
    assert more.close()
    assert isinstance(read.header, Header)
    same_bits(again(open_replay(tmp_path / "more.rec"))[0].estimate, plain.estimate)
