"""Comparison on emulated cars under a virtual clock: figures come from the cars' estimates."""

import json
import sys

import numpy as np
import pytest

from agents.cli.main import main
from agents.comparison import hardware
from agents.comparison.contender import Contender
from agents.comparison.hardware import compare_hardware
from agents.comparison.meter import IN_FORMATION
from agents.controllers import Consensus
from agents.errors import UsageError
from agents.hardware.drive import keys
from agents.hardware.emulate import EmulateOptions
from agents.hardware.emulate.virtual import VirtualBridge
from agents.reports.compare_report import (
    HEADER,
    SHORT_HEADER,
    compare_files,
    notes,
    rows,
    short_rows,
)
from hardware_bridge.errors import BridgeError
from relpos_env.world.car import CarParams

OPTIONS = EmulateOptions(scenario="cars-nlos", seed=3, seconds=600.0)
CONFIG = VirtualBridge(OPTIONS).config


class Watched(VirtualBridge):
    """A bridge that records the drivers it runs, and may fail."""

    def __init__(self, broken_at=None):
        super().__init__(OPTIONS)
        self.seen, self._broken_at, self.closed = [], broken_at, False

    def env(self, **arguments):
        self.seen.append(arguments["observation"])
        if len(self.seen) == self._broken_at:
            raise BridgeError("cars.1: on fire")
        return super().env(**arguments)

    def close(self):
        self.closed = True
        super().close()


def run(bridge, drivers=("consensus",), observations=("estimate",), **arguments):
    chosen = {"episodes": 1, "seconds": 1.0, "settle": 0.5, "arm": True, **arguments}
    return compare_hardware(
        swarm=CONFIG, drivers=drivers, observations=observations,
        open_bridge=lambda: bridge, **chosen,
    )  # fmt: skip


@pytest.fixture(scope="module")
def watched():
    return Watched()


@pytest.fixture(scope="module")
def result(watched):
    return run(watched, observations=["estimate", "truth", "estimate_cov"], episodes=3)


def test_drivers_take_turns_and_each_begins_a_round(watched, result):
    first, second = "estimate", "estimate_cov"
    # The first two are the warm-up.
    assert watched.seen[2:] == [first, second, second, first, first, second]
    assert watched.closed
    assert [text for _, text in watched.feed.notices] == ["arm", "quit"]


def test_records_say_that_nobody_knows_the_truth(result):
    assert [r["observation"] for r in result.records] == ["estimate", "estimate_cov"]
    for record in (*result.records, *result.episode_records):
        json.dumps(record, allow_nan=False)
        assert record["errors_from"] == "estimates"
        assert record["tracking_error"] is None
        assert record["collisions_per_min"] is None
        assert record["contact_time"] is None
        assert record["formation_error"] > 0.0
        assert record["energy"] > 0.0
        assert record["scenario"] == "emulated cars-nlos"
    assert [r["seed"] for r in result.episode_records] == [1, 2, 3] * 2
    assert result.notes == ("consensus on truth in emulated cars-nlos: real cars know no truth",)
    assert result.remarks == ()


def test_the_report_has_dashes_and_no_films(result):
    lines = rows(result, "emulated cars-nlos")
    assert [line[5:7] for line in lines] == [["-", "-"]] * 2
    assert {len(line) for line in lines} == {len(HEADER)}
    assert {len(r) for r in short_rows(result, "emulated cars-nlos")} == {len(SHORT_HEADER)}
    text = "\n".join(notes(result))
    assert "3 episodes of 1 s each, in rounds" in text
    assert "what the cars estimated" in text
    assert "Left out: consensus on truth" in text
    files = compare_files(result)
    assert set(files) == {
        "report.html", "results.jsonl", "compare-figures.svg", "compare-time.svg",
        "compare-ratios.svg",
    }  # fmt: skip
    assert "<canvas" not in files["report.html"]
    assert len(files["results.jsonl"].splitlines()) == 2 + 6


def test_figures_are_what_the_cars_believe():
    """The same drive in a loop of its own: it is equal every time."""
    (row,) = run(VirtualBridge(OPTIONS), seconds=2.0, settle=1.0).rows
    (episode,) = row.episodes
    bridge = VirtualBridge(OPTIONS)
    bridge.env(max_cycles=1)
    env = bridge.env(max_cycles=20)
    observations, _ = env.reset()
    controller, error, worst = Consensus(env.fields), [], []
    speeds = [np.abs(bridge.swarm.view.speed[0])]
    while env.agents:
        actions = {agent: controller.act(seen) for agent, seen in observations.items()}
        observations, _, _, _, infos = env.step(actions)
        error.append(np.mean([info["formation_error"] for info in infos.values()]))
        worst.append(max(info["formation_error"] for info in infos.values()))
        speeds.append(np.abs(bridge.swarm.view.speed[0]))
    bridge.close()
    np.testing.assert_allclose(episode.error, error, rtol=1e-12)
    assert episode.formation_error == pytest.approx(np.mean(error[10:]))
    assert episode.time_in_formation == pytest.approx(np.mean(np.array(worst[10:]) < IN_FORMATION))
    car, before, after = CarParams(), np.array(speeds[:-1]), np.array(speeds[1:])
    rolling = car.rolling_resistance * car.mass * 9.80665
    work = 0.5 * car.mass * (after**2 - before**2) + rolling * 0.05 * (before + after)
    assert episode.energy == pytest.approx(np.maximum(work, 0.0).sum() / 3 * 30.0, rel=1e-3)
    assert episode.seconds == 2.0
    assert np.isnan(episode.tracking_error)
    assert np.isnan(episode.collisions_per_min)


def test_complete_rounds_are_kept_when_it_is_interrupted():
    bridge, n = Watched(), [0]

    def attend(order):
        n[0] += len(bridge.seen) == 6  # the last episode of the second round
        if n[0] == 30:
            order("quit")

    result = run(bridge, observations=["estimate", "estimate_cov"], episodes=9, attend=attend)
    assert [len(row.episodes) for row in result.rows] == [1, 1]
    assert result.seeds == 1
    assert result.remarks == ("Interrupted",)
    assert any("Interrupted." in line for line in notes(result))
    assert bridge.closed


def test_complete_rounds_are_kept_when_a_car_fails():
    result = run(Watched(broken_at=3), episodes=5)
    assert result.seeds == 1
    assert result.remarks == ("Ended early: cars.1: on fire",)
    bridge = Watched(broken_at=2)
    with pytest.raises(BridgeError, match="on fire"):
        run(bridge, episodes=5)
    assert bridge.closed


def test_it_may_end_before_anything_was_driven():
    bridge = Watched()
    with pytest.raises(UsageError, match="before every driver had driven once"):
        run(bridge, attend=lambda order: order("quit"))
    assert bridge.closed


def test_cars_that_were_stopped_are_told_of():
    bridge = Watched()

    def attend(order):
        # A node is silent in mid-episode, for half a second.
        if len(bridge.seen) == 2 and bridge.rig.world.t > 16.0:
            bridge.rig.emulator.nodes[0].node.be_silent(16.6)

    result = run(bridge, seconds=12.0, attend=attend)
    assert result.remarks == ("cars.1 stopped: no message from its node, or no estimate",)


def test_drivers_with_beams_and_none_at_all_are_refused(monkeypatch):
    class Seer:
        title, trained_on, history, proximity = "seer", "estimate", 1, 8

    monkeypatch.setattr(hardware, "find_entry", lambda name: Seer())
    monkeypatch.setattr(
        hardware, "line_up", lambda names, modes, n: [Contender(k, m) for k in names for m in modes]
    )
    with pytest.raises(
        UsageError, match="nothing to compare: seer on estimate .* expected 8 distance sensors"
    ):
        run(None, drivers=["seer"])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"arm": False}, "--arm: a comparison needs cars that move"),
        ({"drivers": ["magic"]}, "NAME: expected one of consensus"),
        ({"observations": ["truth"]}, "nothing to compare: .* real cars know no truth"),
        ({"observations": ["moon"]}, "--observation: expected one of estimate"),
        ({"episodes": 0}, "--episodes: expected 1 to"),
        ({"settle": 1.0}, "--settle: expected 0 to less"),
    ],
    ids=lambda v: next(iter(v)) if isinstance(v, dict) else "",
)
def test_what_makes_no_sense_is_refused_before_anything_is_opened(arguments, message):
    with pytest.raises(UsageError, match=message):
        run(None, **arguments)


def command(monkeypatch, capsys, *args):
    monkeypatch.setattr(sys, "argv", ["relpos", "compare", "consensus", *args])
    with pytest.raises(SystemExit) as ended:
        main()
    return ended.value.code, capsys.readouterr()


@pytest.mark.parametrize(
    ("args", "message"),
    [
        (["--arm"], "--arm: expected together with --config"),
        (["--config", "cars.toml", "--arm", "--jobs", "2"], "--jobs: expected without --config"),
        (["--config", "cars.toml", "--task", "ring"], "--task: expected without --config"),
        (["--config", "cars.toml", "--first-seed", "7"], "--first-seed: expected without --config"),
        (["--config", "cars.toml", "--arm"], "--arm: expected a terminal, on which space stops"),
        (["--config", "cars.toml"], "--arm: a comparison needs cars that move"),
    ],
    ids=" ".join,
)
def test_faults_end_in_one_line(args, message, monkeypatch, capsys, tmp_path):
    monkeypatch.chdir(tmp_path)
    code, shown = command(monkeypatch, capsys, *args)
    assert code == 2
    assert message in shown.err
    assert shown.out == ""


def test_the_command_compares_on_cars(monkeypatch, capsys, tmp_path):
    (tmp_path / "swarm.toml").write_text(CONFIG.text)
    bridge = VirtualBridge(OPTIONS)
    opened = []

    def opens(config, **arguments):
        opened.append((config.name, arguments))
        return bridge

    monkeypatch.setattr(hardware, "Bridge", opens)
    monkeypatch.setattr(keys, "check_stop_source", lambda source: None)  # as on a terminal
    args = ["--config", str(tmp_path / "swarm.toml"), "--arm", "--episodes", "1"]
    args += ["--seconds", "1", "--settle", "0.5", "--json", "--out", str(tmp_path / "out")]
    monkeypatch.setattr(sys, "argv", ["relpos", "compare", "consensus", *args])
    main()
    (record,) = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert opened == [("emulated cars-nlos", {"drive": True, "arm": True, "wait": 60.0})]
    assert (record["policy"], record["errors_from"]) == ("consensus", "estimates")
    assert (tmp_path / "out" / "report.html").exists()
