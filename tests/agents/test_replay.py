"""Replayed recordings: figures, exports, truth, damage, and the command line."""

import json
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner
from recorded_runs import START, WALL, run_live, same_bits

from agents.cli.main import cli
from agents.errors import UsageError
from agents.evaluation.track import track_log
from agents.hardware.emulate import EmulateOptions
from agents.hardware.replay import replay
from agents.hardware.replay.exports import export_replay
from agents.hardware.replay.truth import find_offset
from hardware_bridge.errors import BridgeError
from hardware_bridge.recording import Kind, Recorder, read_recording
from tracking.log import read_log, write_log
from tracking.log.truth import Truth


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Make a live run of 12 s in which cars drive, with truth and exact ranges.

    Range errors that last for a metre of driving determine its time to some 30 ms only.
    """
    folder = tmp_path_factory.mktemp("run")
    scenario = folder / "exact.toml"
    scenario.write_text('extends = "cars-los"\n[radio.channel]\nplace = "exact"\n')
    options = EmulateOptions(scenario=str(scenario), seed=3, seconds=30.0, operator=False)
    run = run_live(folder, options, 120, record_truth=True)
    write_log(folder / "truth", run.log)
    return run


@pytest.fixture(scope="module")
def result(run):
    return replay(run.path, truth=run.log, skip=5.0)


def relpos(*args):
    return CliRunner().invoke(cli, [str(arg) for arg in args], catch_exceptions=True)


def test_it_gives_what_was_live(run, result):
    same_bits(result.estimate, run.estimate)
    np.testing.assert_array_equal(result.t_ns, run.t_ns)
    assert result.flaws == []
    assert result.counts["measurements"]["range"] == result.block.count(5) > 1000
    assert result.seconds == pytest.approx(12.0, abs=0.1)
    assert {s["stream"] for s in result.streams} >= {"links.n1", "cars.1"}
    assert json.dumps(result.summary, allow_nan=False)


def test_the_truth_is_found_by_the_ranges(run, result):
    # The rig's time began with the recording; bytes are delayed by up to some 30 ms.
    assert result.scored.offset == pytest.approx(0.015, abs=0.02)
    assert result.scored.score.rmse < 0.5
    moved = replace(run.log.truth, t=run.log.truth.t + 777.7)
    group = run.config.constellation
    assert find_offset(moved, result.block, group) == pytest.approx(
        result.scored.offset - 777.7, abs=0.002
    )
    given = replay(run.path, truth=run.log, truth_offset=result.scored.offset, skip=5.0)
    assert given.summary["rmse"] == result.summary["rmse"]
    assert given.summary["truth_offset"] == result.scored.offset


def test_the_errors_are_those_of_the_log_of_the_same_run(run, result):
    tracked = track_log(run.log, skip=5.0)
    assert result.scored.score.rmse == pytest.approx(tracked.score.rmse, rel=0.1)


def test_a_truth_that_says_nothing_of_the_time_is_refused(run, result):
    truth, group = run.log.truth, run.config.constellation
    first = truth.pos_w[[int(np.nonzero(truth.node == n)[0][0]) for n in range(3)]]
    standing = replace(truth, pos_w=first[truth.node])
    with pytest.raises(UsageError, match="--truth-offset"):
        find_offset(standing, result.block, group)
    with pytest.raises(UsageError, match="has no truth"):
        replay(run.path, truth=replace(run.log, truth=Truth.empty()))


def test_exports_are_all_or_nothing(run, result, tmp_path):
    from mcap.reader import make_reader

    written = export_replay(result, tmp_path / "out", ("log", "mcap", "tum"))
    assert [path.name for path in written] == ["log", "run.mcap", "tum"]
    log = read_log(tmp_path / "out" / "log")
    assert log.n_ranges == result.counts["measurements"]["range"]
    with open(tmp_path / "out" / "run.mcap", "rb") as file:
        summary = make_reader(file).get_summary()
    assert abs(summary.statistics.message_start_time - WALL) < 2 * 10**9
    line = (tmp_path / "out" / "tum" / "node_2.txt").read_text().splitlines()[1]
    assert 0.0 < float(line.split()[0]) - WALL * 1e-9 < 12.0
    with pytest.raises(BridgeError, match="exists already"):
        export_replay(result, tmp_path / "out", ("tum",))
    nothing = replace(result, block=result.block.take(slice(0, 0)))
    with pytest.raises(BridgeError, match="no range"):
        export_replay(nothing, tmp_path / "none", ("tum", "log"))
    assert not (tmp_path / "none").exists()
    with pytest.raises(UsageError, match="--export"):
        export_replay(result, tmp_path / "none", ("csv",))


def test_at_speed_it_takes_its_time_and_gives_the_same(run):
    now, waits = [10**12], []

    def sleep(seconds):
        waits.append(seconds)
        now[0] += round(seconds * 1e9)

    seen = []

    def watch(monitor, notices):
        seen.append(monitor.t_ns)
        return len(seen) < 50

    timed = replay(run.path, speed=2.0, watch=watch, clock=lambda: now[0], sleep=sleep)
    assert sum(waits) == pytest.approx(49 * 0.1 / 2.0, abs=0.01)
    assert len(timed.t_ns) == 50
    same_bits(timed.estimate, run.estimate, 50)
    assert timed.realtime_factor == pytest.approx(2.0, rel=0.05)
    assert timed.summary["stopped"]
    assert timed.flaws == ["the replay was stopped after 5.0 s"]


def test_one_that_is_interrupted_says_so(run, tmp_path):
    def watch(monitor, notices):
        if monitor.decisions > 20:
            raise KeyboardInterrupt

    assert replay(run.path, watch=watch).flaws
    assert not replay(run.path).summary["stopped"]


def test_flaws_are_told(run, tmp_path):
    data = bytearray(run.path.read_bytes())
    data[len(data) // 3] ^= 0xFF
    (tmp_path / "bad.rec").write_bytes(data[: len(data) // 2])
    flawed = replay(tmp_path / "bad.rec")
    assert len(flawed.flaws) == 2
    assert flawed.summary["torn"]
    assert flawed.summary["damaged"] == 1
    done = relpos("replay", tmp_path / "bad.rec")
    assert done.exit_code == 0
    assert done.output.count("incomplete: ") == 2
    # The number that the recorder reported as dropped.
    read = read_recording(run.path)
    lossy = Recorder(tmp_path / "lossy.rec", read.header)
    lossy.add(Kind.TICK, 0, START + 10**8)
    lossy.add_event(START + 10**9, "recording_lost", records=7, why="no room")
    assert lossy.close()
    assert replay(tmp_path / "lossy.rec").lost == ((pytest.approx(1.0), 7, "no room"),)


def test_what_cannot_be_replayed(run, tmp_path):
    (tmp_path / "text.rec").write_text("hello")
    with pytest.raises(BridgeError, match="not a recording"):
        replay(tmp_path / "text.rec")
    Recorder(tmp_path / "empty.rec", read_recording(run.path).header).close()
    with pytest.raises(BridgeError, match="no decision"):
        replay(tmp_path / "empty.rec")
    for speed in (0.0, 1e-300, float("inf")):
        with pytest.raises(UsageError, match="speed"):
            replay(run.path, speed=speed)


def test_the_command_line(run, tmp_path):
    done = relpos(
        "replay", run.path, "--truth", run.path.parent / "truth", "--skip", "5",
        "--export", "tum", "--out", tmp_path / "out",
    )  # fmt: skip
    assert done.exit_code == 0, done.output
    assert "against the truth" in done.output
    assert (tmp_path / "out" / "tum" / "node_2.txt").exists()
    done = relpos("replay", run.path, "--json")
    records = [json.loads(line) for line in done.stdout.splitlines()]
    pairs = [r for r in records if r["result"] == "pair"]
    assert len(pairs) == 3 * 120
    assert pairs[-1].keys() >= {"forward", "left", "distance", "std", "age", "nlos_prob", "status"}
    ok = [p for p in pairs if p["status"] == "ok"]
    assert ok
    assert ok[-1]["distance"] == pytest.approx(np.hypot(ok[-1]["forward"], ok[-1]["left"]))
    assert records[-1]["result"] == "replay"
    for args, match in (
        (("--fast", "--speed", "1"), "--fast"),
        (("--export", "tum"), "--out"),
        (("--export", "csv", "--out", tmp_path / "x"), "--export"),
        (("--truth-offset", "soon"), "--truth-offset"),
        (("--skip", "nan"), "--skip"),
    ):
        done = relpos("replay", run.path, *args)
        assert isinstance(done.exception, UsageError)
        assert match in str(done.exception)
