"""Policies on the command line: shown, driven, refused in one line."""

import json
import subprocess
import sys

import numpy as np
import pytest
from click.testing import CliRunner
from policy_files import LAYOUT, card_of, good_model, put

from agents.cli.main import cli
from agents.comparison.blindfold import Blindfold
from agents.errors import UsageError
from agents.policies import Layout, PolicyError, find, load_policy, shipped_names, write_policy
from agents.simulation.demo import demo
from relpos_env.errors import EnvError


def small(folder, layout=LAYOUT, name="small"):
    data = good_model(size=layout.size).SerializeToString()
    write_policy(folder, name, data, card_of(data, layout=layout))
    return folder / f"{name}.onnx"


def run(*args):
    return CliRunner().invoke(cli, list(map(str, args)))


def test_a_card_is_shown(tmp_path):
    path = small(tmp_path)
    shown = run("policy", "show", path)
    assert shown.exit_code == 0, shown.output
    for words in ("Policy small", "'estimate' of 3 cars", "2 m/s", "0.42 rad", "0.1 s", "rad"):
        assert words in shown.output
    record = json.loads(run("policy", "show", path, "--json").output)
    assert record == json.loads(path.with_suffix(".json").read_text())


def test_a_card_is_shown_whole():
    training = load_policy("hold-beams").card.training
    shown = run("policy", "show", "hold-beams").output
    assert training["command"] in shown
    assert "\u2026" not in shown


def test_shipped_ones_are_listed(tmp_path, monkeypatch):
    monkeypatch.setattr(find, "SHIPPED", tmp_path)
    assert "no policies" in run("policy", "list").output
    assert run("policy", "list", "--json").output == ""
    small(tmp_path, name="one")
    small(tmp_path, Layout("ranges", 6, 2), name="two")
    rows = [json.loads(line) for line in run("policy", "list", "--json").output.splitlines()]
    assert rows[1] == {
        "name": "two",
        "observation": "ranges",
        "n_cars": 6,
        "history": 2,
        "proximity": 0,
    }
    assert "two" in run("policy", "list").output
    assert run("policy", "show", "two").exit_code == 0


def test_what_stands_in_a_card_does_not_reach_the_terminal(tmp_path):
    data = good_model().SerializeToString()
    path = put(tmp_path, data, card_of(data, training={"\x1b[2J": "\x1b]0;x\a[red]"}))
    shown = run("policy", "show", path)
    assert shown.exit_code == 0, shown.output
    assert "\x1b" not in shown.output
    assert "[red]" in shown.output


def test_it_is_refused_in_one_line(tmp_path):
    path = tmp_path / "x.zip"
    with pytest.raises(PolicyError, match="execute code"):
        CliRunner().invoke(cli, ["policy", "show", str(path)], catch_exceptions=False)


@pytest.mark.parametrize(
    ("layout", "has_truth"),
    [(Layout("estimate", 6), True), (Layout("truth", 3, 2), True), (Layout("ranges", 4), False)],
    ids=str,
)
def test_a_policy_drives_the_demonstration(tmp_path, layout, has_truth):
    result = demo(scenario="cars-nlos", seconds=1.0, policy=small(tmp_path, layout))
    assert result.driver == "small"
    assert (result.formation_error_truth is not None) == has_truth
    assert result.seconds == pytest.approx(1.0)
    assert result.summary[-1]["driver"] == "small"


def test_a_policy_does_what_it_was_trained_for(tmp_path):
    shown = demo(policy="hold", seconds=0.5)
    assert (shown.task, shown.scenario) == ("hold", "cars-nlos")
    assert demo(policy="hold", task="ring", seconds=0.5).scenario == demo(seconds=0.5).scenario
    untold = small(tmp_path, LAYOUT)  # its card does not name the task
    assert demo(policy=untold, scenario="cars-nlos", seconds=0.5).task == "ring"


def test_beams_of_a_demonstration_are_those_of_the_policy(tmp_path):
    small(tmp_path, Layout("estimate", 3, 1, 4), name="small")
    policy = tmp_path / "small.onnx"
    assert demo(policy=policy, scenario="cars-nlos", seconds=0.5).driver == "small"
    with pytest.raises(
        UsageError, match="proximity: expected 4, the distance sensors of the policy, got 8"
    ):
        demo(policy=policy, proximity=8)
    assert isinstance(run("demo", "--proximity", "33").exception, UsageError)


def test_a_policy_for_fewer_cars_is_refused(tmp_path):
    with pytest.raises(PolicyError, match="more cars than the policy has slots for"):
        demo(scenario="hall", task="hold", seconds=1.0, policy=small(tmp_path))


def test_a_policy_or_a_controller(tmp_path):
    for way in (
        lambda: demo(seconds=1.0, policy="x", controller="consensus"),
        lambda: CliRunner().invoke(
            cli, ["demo", "--policy", "x", "--controller", "consensus"], catch_exceptions=False
        ),
    ):
        with pytest.raises(Exception, match="expected either a policy or a"):
            way()
    with pytest.raises(EnvError, match="controller: expected one of consensus"):
        demo(seconds=1.0, controller="magic")


def test_the_help_names_the_controllers():
    from agents.controllers import CONTROLLERS

    page = run("demo", "--help").output
    assert all(name in page for name in CONTROLLERS)


@pytest.mark.parametrize("mode", ["estimate", "estimate_cov", "ranges", "truth"])
def test_a_blindfold_hides_the_others_and_nothing_else(mode):
    layout = Layout(mode, 4, 2)
    seen = np.random.default_rng(0).uniform(-1.0, 1.0, (5, layout.size)).astype(np.float32)
    blind = Blindfold(layout)(seen).reshape(5, 2, -1)
    seen = seen.reshape(5, 2, -1)
    alone = layout.alone().reshape(2, -1)[0]
    for row in layout.index:
        here = slice(row["first"], row["last"] + 1)
        kept = row["name"] in ("has_target", "target", "command", "heading", "motion")
        assert np.array_equal(blind[..., here], seen[..., here] if kept else
                              np.broadcast_to(alone[here], blind[..., here].shape))  # fmt: skip


def test_bench_lines_have_a_peer():
    done = run("bench", "policy", "--steps", 20, "--json")
    assert done.exit_code == 0, done.output
    rows = [json.loads(line) for line in done.output.splitlines()]
    assert len(rows) == 4 + len(shipped_names())
    for row in rows:
        assert row["ratio"] == pytest.approx(row["peer_value"] / row["value"])
        assert 0.0 < row["value"] < 1e6
    with pytest.raises(UsageError, match="--steps: expected 1 to"):
        CliRunner().invoke(cli, ["bench", "policy", "--steps", "0"], catch_exceptions=False)


def test_it_drives_where_no_trainer_is_installed(tmp_path):
    code = f"""
import logging, sys
logging.getLogger("tracking.kernels.jit").setLevel(logging.ERROR)  # compiling may be announced
class Block:
    def find_spec(self, name, path=None, target=None):
        if name in ("torch", "stable_baselines3", "onnx", "onnxscript", "cloudpickle"):
            raise ImportError(name)
sys.meta_path.insert(0, Block())
from agents.simulation.demo import demo
print(demo(scenario="cars-nlos", seconds=1.0, policy={str(small(tmp_path))!r}).driver)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stdout == "small\n", done.stderr
    assert done.stderr == ""
