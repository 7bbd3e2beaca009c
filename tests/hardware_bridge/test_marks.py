"""Replay protection: signed messages are accepted once, across any restarts."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from agents.hardware.emulate import EmulateOptions
from agents.hardware.emulate.rig import STEP_NS, EmulatedRig
from hardware_bridge.config import read_config
from hardware_bridge.errors import BridgeError
from hardware_bridge.links.ports import Chunk
from hardware_bridge.live.bridge import Bridge
from hardware_bridge.live.marks import AHEAD, EVERY_NS, KeptMarks
from hardware_bridge.live.replay import open_replay
from hardware_bridge.live.swarm import LiveSwarm

KEY = bytes(range(16))
S = 1_000_000_000


@pytest.fixture
def said(tmp_path):
    """Return the configuration of three signed nodes and cars and their messages of a second."""
    rig = EmulatedRig(EmulateOptions(scenario="cars-nlos", seed=3, key=KEY))
    path = tmp_path / "swarm.toml"
    path.write_text(rig.swarm_toml(Path("/nowhere")))
    lines = []
    for k in range(1, 101):
        rig.step(k * STEP_NS)
        for name, port in rig.ports.items():
            line = f"cars.{name[3:]}" if name.startswith("car") else f"links.{name}"
            if data := port.receive():
                lines.append(Chunk(line, k * STEP_NS, data))
    rig.close()
    assert {line.link for line in lines} >= {"links.n1", "links.n2", "links.n3"}
    return path, lines


def hears(path, lines):
    """Feed the lines to an intake with the kept marks; return the intake and its marks."""
    swarm = LiveSwarm(read_config(path), 0)
    marks = KeptMarks(swarm.config.marks, swarm.intake)
    for chunk in lines:
        swarm.take(chunk)
    return swarm.intake, marks


def test_a_recording_of_the_last_time_is_refused_by_the_next_host(said):
    path, lines = said
    intake, marks = hears(path, lines)
    assert len(intake.events) > 200
    assert not intake.refused
    marks.close()
    again, _ = hears(path, lines)
    assert len(again.events) == 0
    assert again.refused["replay"] + again.refused["duplicate"] + again.refused["stale"] > 200
    # Messages after the last marks are accepted.
    first, second = lines[: len(lines) // 2], lines[len(lines) // 2 :]
    path.with_suffix(".marks.json").unlink()
    hears(path, first)[1].close()
    later, _ = hears(path, second)
    assert len(later.events) > 100
    assert not later.refused


def test_after_a_crash_nothing_that_was_heard_is_believed(said):
    path, lines = said
    intake, marks = hears(path, lines[:20])
    marks.keep(S)
    marks._writing.join()
    # No close: the process was killed after further messages had arrived.
    for chunk in lines[20:]:
        intake.take(chunk)
    again, _ = hears(path, lines)
    heard = {1, 2, 3} & {node for node in intake.marks()["links"]}
    assert heard == {1, 2, 3}
    assert len(again.events) == 0


def test_they_are_written_now_and_then(said):
    path, lines = said
    _, marks = hears(path, lines)
    file = path.with_suffix(".marks.json")
    for t_ns, written in ((S, True), (2 * S, False), (S + EVERY_NS, True)):
        file.write_text("{}")
        marks.keep(t_ns)
        if marks._writing is not None:
            marks._writing.join()
        assert (file.read_text() != "{}") == written
    ahead = json.loads(file.read_text())["links"]["1"]
    marks.close()
    assert ahead[1] - json.loads(file.read_text())["links"]["1"][1] == AHEAD


DAMAGED = (
    "", "[]", '{"links": 3}', '{"links": {"a": [1, 2]}}', '{"links": {"1": [1]}}',
    '{"links": {"1": [1, "x"]}}',
)  # fmt: skip


@pytest.mark.parametrize("text", DAMAGED)
def test_a_damaged_file_is_told(said, text):
    path, lines = said
    file = path.with_suffix(".marks.json")
    file.write_text(text)
    with pytest.raises(BridgeError, match=r"swarm\.marks\.json: damaged.*delete it"):
        hears(path, lines)
    assert file.read_text() == text


def test_without_keys_nothing_is_kept(said):
    path, _ = said
    text = "".join(li for li in path.read_text().splitlines(True) if not li.startswith("key"))
    path.write_text(text)
    assert read_config(path).marks is None


def test_a_replay_knows_what_was_old(tmp_path):
    with_ports = EmulatedRig(
        EmulateOptions(scenario="cars-nlos", seed=3, key=KEY), tmp_path / "rig"
    )
    config = read_config(tmp_path / "rig" / "swarm.toml")
    old = {"links": {2: (1 << 31, 0)}, "cars.1": {1: (7, 7)}}
    config.marks.write_text(json.dumps(old))
    try:
        with Bridge(replace(config), record=tmp_path / "run.relpos"):
            pass
    finally:
        with_ports.close()
    marks = open_replay(tmp_path / "run.relpos").swarm.intake.marks()
    assert marks["links"] == old["links"]
    assert marks["cars.1"] == old["cars.1"]
