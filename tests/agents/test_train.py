"""Training: runs that stop and resume, folders, networks, files."""

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pytest
import torch
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st
from small_runs import SMALL, same, small, weights

from agents.cli.main import cli
from agents.errors import UsageError
from agents.policies import load_policy
from agents.policies.layout import Layout
from agents.settings import as_options, from_options, leaves
from agents.training.begin import begin_with
from agents.training.config import TrainConfig
from agents.training.environments import (
    check_environments,
    choice_environments,
    layout_of,
    make_rooms,
    shares,
    weights_of,
)
from agents.training.evaluation import Evaluation
from agents.training.export import export_policy, read_results
from agents.training.ppo.learner import level_of, make_model, make_policy, run_interval
from agents.training.ppo.network import Actor
from agents.training.run import train_policy
from agents.training.run_folder import BEST, LAST, RunFolder, restore_weights
from agents.training.train import train
from relpos_env.errors import EnvError


def from_words(words):
    """Return settings from the arguments of a command."""
    named, given = {leaf.option: leaf for leaf in leaves(TrainConfig)}, {}
    for option, text in zip(words[::2], words[1::2], strict=True):
        leaf = named[option]
        given[leaf.name] = [*given.get(leaf.name, []), text] if leaf.many else text
    return from_options(TrainConfig, given)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Make an uninterrupted run."""
    folder = tmp_path_factory.mktemp("runs") / "whole"
    return train(small(), folder)


@pytest.fixture(scope="module")
def policy(run, tmp_path_factory):
    return export_policy(run.folder, tmp_path_factory.mktemp("policies"), name="small")


def test_same_seed_same_weights(run, tmp_path):
    train(small(), tmp_path / "again")
    assert same(weights(run.folder), weights(tmp_path / "again"))
    train(small(seed="1"), tmp_path / "other")
    assert not same(weights(run.folder), weights(tmp_path / "other"))


def test_a_run_begins_with_a_policy(run, policy, tmp_path):
    config = small(begin=str(policy), seed="5", eval_interval="1")
    model = make_model(config, make_rooms(config, None))
    begin_with(model.policy, config)
    trained = make_policy(small())
    restore_weights(trained, RunFolder(run.folder).load(BEST)[0])
    given = dict(Actor(trained).named_parameters())
    begun = {k: w.detach().clone() for k, w in Actor(model.policy).named_parameters()}
    assert all(torch.equal(w, given[k]) for k, w in begun.items())
    critic = model.policy.value_net.weight.detach().clone()
    run_interval(model, config, 0)  # at first only the critic is trained
    assert all(torch.equal(w, begun[k]) for k, w in Actor(model.policy).named_parameters())
    assert not torch.equal(model.policy.value_net.weight, critic)


@pytest.mark.parametrize(
    ("begin", "other", "message"),
    [
        ("missing", {}, "no such file"),
        ("hold", {}, "other numbers"),
        (None, {"width": "16"}, "another shape"),
    ],
)
def test_a_run_does_not_begin_with_a_policy_that_does_not_fit(
    policy, tmp_path, begin, other, message
):
    with pytest.raises(UsageError, match=message):
        train(small(begin=begin or str(policy), **other), tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_a_run_that_was_stopped_goes_on_as_if_it_had_not_been(run, tmp_path):
    class Stop(Exception):
        pass

    def stop(share, row):
        if row is not None and row["interval"] == 1:
            raise Stop

    with pytest.raises(Stop):
        train(small(), tmp_path / "run", progress=stop)
    assert not same(weights(run.folder), weights(tmp_path / "run"))
    resumed = train(None, tmp_path / "run")
    assert same(weights(run.folder), weights(tmp_path / "run"))
    assert same(weights(run.folder, BEST), weights(tmp_path / "run", BEST))
    strip = [{k: v for k, v in r.items() if k != "seconds"} for r in run.records]
    assert strip == [{k: v for k, v in r.items() if k != "seconds"} for r in resumed.records]
    assert len(strip) == 3


def test_the_noise_of_actions_falls_to_what_is_asked(run, tmp_path):
    """The tolerance is for the few optimisation steps since the last update of the bound."""
    train(small(final_log_std="1"), tmp_path / "left")
    free = weights(tmp_path / "left")["policy.log_std"]
    assert (weights(run.folder)["policy.log_std"] < -2.2).all()
    assert (free > -1.1).all()


def test_weights_of_rewards_go_to_their_final_values_along_the_run(tmp_path):
    config = small(
        task="hold", weights="collision=8", final_weights=("progress=0", "collision=12"), levels=""
    )
    assert weights_of(config, 0.0) == {"collision": 8.0, "progress": 5.0}
    assert weights_of(config, 0.375) == pytest.approx({"collision": 10.0, "progress": 2.5})
    assert weights_of(config, 1.0) == {"collision": 12.0, "progress": 0.0}
    # Policies are evaluated with the final weights at any time.
    assert dict(check_environments(config)[0].config.weights) == weights_of(config, 1.0)
    whole = train(config, tmp_path / "whole")
    seen = []

    class Stop(Exception):
        pass

    def stop(share, row):
        if row is not None:
            seen.append(share)
            raise Stop

    with pytest.raises(Stop):
        train(config, tmp_path / "run", progress=stop)
    train(None, tmp_path / "run")
    assert same(weights(whole.folder), weights(tmp_path / "run"))
    train(small(task="hold", weights="collision=8", levels=""), tmp_path / "fixed")
    assert not same(weights(whole.folder), weights(tmp_path / "fixed"))


def test_rewards_count_by_the_weights_of_the_moment():
    rooms = make_rooms(small(weights="collision=8", final_weights="collision=12"), None)
    rooms.reset()
    term = rooms.parts[0].formation.task.terms.index("collision")
    assert all(part.formation.weights[term] == 8.0 for part in rooms.parts)
    rooms.reweigh({"collision": 11.0})
    assert all(part.formation.weights[term] == 11.0 for part in rooms.parts)
    with pytest.raises(EnvError, match="joy"):
        rooms.reweigh({"joy": 1.0})
    rooms.close()


def test_the_best_policy_is_best_in_all_scenarios_together():
    config = replace(small(), eval_episodes=5)
    policy, layout = make_policy(config), layout_of(config)

    def measured(*names, episodes):
        of = replace(config, env=replace(config.env, scenarios=names))
        evaluation = Evaluation(check_environments(of), layout, episodes, 1)
        found = evaluation.run(policy)
        evaluation.close()
        return found

    one = measured("cars-los", episodes=2)
    assert one == measured("cars-los", episodes=2)
    both = measured("cars-los", "ring-los", episodes=5)
    other = measured("ring-los", episodes=3)
    # Both have equally many cars; the second scenario has other seeds than alone.
    low, high = sorted([one["return"], other["return"]])
    assert low - 0.2 < both["return"] < high + 0.2
    assert both["return"] != one["return"]
    assert sorted(shares(5, 2)) == [2, 3]


def test_every_scenario_needs_an_episode():
    config = small()
    both = replace(config.env, scenarios=("cars-los", "ring-los"))
    with pytest.raises(UsageError, match="--eval-episodes: expected at least 2"):
        check_environments(replace(config, env=both, eval_episodes=1))
    with pytest.raises(UsageError, match="--choice-episodes: expected at least 3"):
        check_environments(replace(config, choice_scenarios=("cars-los",)))


def test_rooms_that_tell_which_policy_is_kept_are_not_learned_in():
    config = small(scenarios="cars-los")
    with pytest.raises(UsageError, match="--choice-scenario: expected .* not learned in"):
        check_environments(replace(config, choice_scenarios=("cars-los",)))
    with pytest.raises(EnvError, match="nowhere"):
        check_environments(replace(config, choice_scenarios=("nowhere",)))
    with pytest.raises(UsageError, match="--cars: expected at least 8"):
        check_environments(replace(config, choice_scenarios=("random",)))
    both = replace(config, choice_scenarios=("hall",))
    assert [p.n_cars for p in check_environments(both)] == [3]
    assert [p.n_cars for p in choice_environments(both)] == [3, 5]


@pytest.mark.slow
def test_a_run_that_was_killed_goes_on_as_if_it_had_not_been(run, tmp_path):
    folder = tmp_path / "run"
    options = [f"--{k.replace('_', '-')}={v}" for k, v in SMALL.items()]
    code = "from agents.cli.main import main; main()"
    command = [sys.executable, "-c", code, "train", "--out", str(folder), *options]
    process = subprocess.Popen(command, stderr=subprocess.DEVNULL, env=dict(os.environ))
    until = time.monotonic() + 120.0
    while not (folder / LAST).exists() and process.poll() is None and time.monotonic() < until:
        time.sleep(0.01)
    process.send_signal(signal.SIGKILL)
    process.wait()
    assert (folder / LAST).exists()
    train(None, folder)
    assert same(weights(run.folder), weights(folder))


def test_the_curriculum_goes_through_its_levels(tmp_path):
    config = small(levels=("0", "2", "3"), frames="1000", scenarios="cars-nlos")
    assert [level_of(config, f) for f in (0, 333, 334, 700, 5000)] == [0, 0, 1 + 1, 3, 3]
    result = train(config, tmp_path / "run")
    assert [r["level"] for r in result.records] == sorted(r["level"] for r in result.records)
    assert {0, 3} <= {r["level"] for r in result.records}


def test_a_central_critic_sees_the_truth_and_the_actor_does_not(tmp_path):
    config = small(critic="central", frames="1000")
    train(config, tmp_path / "run")
    rooms = make_rooms(config, None)
    size = Layout("estimate", 6).size
    assert rooms.observation_space.shape == (size + 48,)
    model = make_model(config, rooms)
    seen = torch.from_numpy(rooms.reset())
    with torch.no_grad():
        blind = seen.clone()
        blind[:, size:] = 0.0
        policy = model.policy
        assert torch.equal(Actor(policy)(seen), Actor(policy)(blind))
        assert not torch.allclose(policy.predict_values(seen), policy.predict_values(blind))
    assert export_policy(tmp_path / "run", tmp_path / "out").exists()


def test_a_policy_with_beams_sees_them_and_is_exported(tmp_path):
    config = small(proximity="8", frames="1000")
    train(config, tmp_path / "run")
    rooms = make_rooms(config, None)
    size = Layout("estimate", 6, 1, 8).size
    assert rooms.observation_space.shape == (size,)
    seen = torch.from_numpy(rooms.reset())
    closer = seen.clone()
    closer[:, -8:] *= 0.1
    actor = Actor(make_model(config, rooms).policy)
    with torch.no_grad():
        assert not torch.allclose(actor(seen), actor(closer))
    path = export_policy(tmp_path / "run", tmp_path / "out")
    assert load_policy(path).layout == Layout("estimate", 6, 1, 8)


def test_the_policy_of_the_last_leg_can_be_exported(run, tmp_path):
    best, last = (
        load_policy(export_policy(run.folder, tmp_path, name=f"last-{k}", last=k)).card.training
        for k in (False, True)
    )
    assert best["interval"] == run.progress.best_interval
    assert last["interval"] == 2
    assert last["measured"]["return"] == run.records[2]["return"]
    seen = np.zeros((1, Layout("estimate", 6, 1).size), np.float32)
    acted = load_policy(tmp_path / "last-True.onnx").driver(Layout("estimate", 6, 1)).act(seen)
    with torch.no_grad():
        policy = make_policy(run.config)
        restore_weights(policy, RunFolder(run.folder).load(LAST)[0])
        expected = Actor(policy)(torch.from_numpy(seen)).numpy()
    np.testing.assert_allclose(acted, expected, atol=1e-5)


@pytest.mark.parametrize("observation", ["estimate", "estimate_cov", "ranges", "truth"])
@pytest.mark.parametrize("history", [1, 3])
def test_the_order_of_the_others_does_not_matter(observation, history):
    layout = Layout(observation, 5, history)
    config = small(observation=observation, history=str(history), cars="5", scenarios="cars-nlos")
    actor = Actor(make_policy(config))
    with torch.no_grad():
        for weight in actor.parameters():
            weight.normal_(generator=torch.Generator().manual_seed(1))
    rng = np.random.default_rng(0)
    seen = rng.uniform(-2.0, 2.0, (7, layout.size)).astype(np.float32)
    order = rng.permutation(4)
    turned = seen.copy()
    first = 0
    for _ in range(history):
        for f in layout.fields:
            if f.name in ("mask", "has_target"):
                seen[:, first : first + f.size] = rng.integers(0, 2, (7, f.size))
            if f.per_other:
                pieces = seen[:, first : first + f.size].reshape(7, 4, -1)
                turned[:, first : first + f.size] = pieces[:, order].reshape(7, -1)
            else:
                turned[:, first : first + f.size] = seen[:, first : first + f.size]
            first += f.size
    with torch.no_grad():
        a, b = actor(torch.from_numpy(seen)), actor(torch.from_numpy(turned))
    assert torch.allclose(a, b, atol=1e-5)


def test_an_exported_network_does_not_tell_where_it_was_written(policy):
    assert b".py" not in policy.read_bytes()


def test_the_exported_policy_does_what_the_trained_one_does(run, policy):
    loaded = load_policy(policy)
    actor = make_policy(run.config)
    actor.load_state_dict(
        {k[7:]: v for k, v in weights(run.folder, BEST).items() if k.startswith("policy.")}
    )
    rng = np.random.default_rng(0)
    seen = rng.uniform(-3.0, 3.0, (50, loaded.card.layout.size)).astype(np.float32)
    with torch.no_grad():
        expected = Actor(actor)(torch.from_numpy(seen)).numpy()
    assert np.allclose(loaded.act(seen), expected, atol=1e-5)
    assert loaded.card.training["observation"] == "estimate"
    assert loaded.card.training["config"]["frames"] == 1400


def test_a_whole_run_ends_with_a_policy_and_a_report(tmp_path):
    result = train_policy(small(frames="1000"), tmp_path / "mine")
    assert result.policy == tmp_path / "mine" / "mine.onnx"
    assert load_policy(result.policy).card.name == "mine"
    assert "Learning curves" in (tmp_path / "mine" / "report.html").read_text()
    assert list((tmp_path / "mine" / "tensorboard").iterdir())


def test_the_command_tells_every_leg_and_the_policy(tmp_path):
    options = [f"--{k.replace('_', '-')}={v}" for k, v in SMALL.items() if k != "frames"]
    command = ["train", "--out", str(tmp_path / "run"), "--frames", "1000", "--json", *options]
    done = CliRunner().invoke(cli, command)
    assert done.exit_code == 0, done.output
    rows = [json.loads(line) for line in done.stdout.splitlines()]
    assert [r["interval"] for r in rows[:-1]] == [0, 1, 2]
    assert rows[-1]["result"] == "policy"
    out = tmp_path / "policies"
    done = CliRunner().invoke(
        cli, ["export", str(tmp_path / "run"), "--out", str(out), "--name", "p", "--json"]
    )
    assert json.loads(done.stdout)["name"] == "p"
    assert {p.name for p in out.iterdir()} == {"p.onnx", "p.json"}
    command = ["export", str(tmp_path / "run"), "--out", str(out), "--name", "p"]
    again = CliRunner().invoke(cli, command)
    assert isinstance(again.exception, UsageError)
    assert "p.onnx exists already" in str(again.exception)
    assert CliRunner().invoke(cli, [*command, "--overwrite"]).exit_code == 0


def test_a_name_that_no_policy_can_have_is_refused_at_once(tmp_path):
    for name in ("my run", "_x", "x" * 65):
        with pytest.raises(UsageError, match="--out: expected a name of letters"):
            train_policy(small(), tmp_path / name)
        assert not (tmp_path / name).exists()


def test_a_task_that_is_done_ends_an_episode_of_the_evaluation():
    """Nothing after the end is rewarded or counted."""
    config = small(task="rendezvous", scenarios="open", eval_episodes="4")
    every, policy = check_environments(config), make_policy(config)
    evaluation = Evaluation(every, layout_of(config), config.eval_episodes, 1)
    (room,) = evaluation._rooms
    whole = room.drive(Actor(policy).eval(), 500)
    step = room.formation.step

    def done_at_once(*actions):
        step(*actions)
        room.formation.task.done[:] = [True, True, False, False]

    room.formation.step = done_at_once
    cut = room.drive(Actor(policy).eval(), 500)
    evaluation.close()
    n_cars, steps = every[0].n_cars, every[0].config.max_cycles - 1
    # The rest of a finished episode counts as time without reward.
    assert cut.decisions == whole.decisions
    assert cut.minutes == pytest.approx(whole.minutes * (steps + 1) / (2 * steps))
    # Two are scored by their only step.
    assert len(cut.error) == len(whole.error) / 2 + 2 * n_cars


@given(
    st.fixed_dictionaries(
        {},
        optional={
            "frames": st.integers(1000, 10**12).map(str),
            "runs": st.integers(1, 64).map(str),
            "gamma": st.floats(0, 1).map(str),
            "log_std": st.floats(-5, 1).map(str),
            "scenarios": st.sampled_from([("open",), ("cars-nlos", "hall")]),
            "levels": st.lists(st.integers(0, 4).map(str), max_size=3),
            "critic": st.sampled_from(["own", "central"]),
            "weights": st.sampled_from([("",), ("collision=8", "place=0")]),
            "final_weights": st.sampled_from([(), ("collision=12",)]),
        },
    )
)
def test_settings_as_options_are_the_same_settings(given):
    config = from_options(TrainConfig, given)
    assert from_words(as_options(config)) == config


def test_the_card_tells_by_which_command_a_policy_was_made(policy):
    training = load_policy(policy).card.training
    assert (training["task"], training["scenario"]) == ("ring", "cars-nlos")
    words = training["command"].split()
    assert words[:4] == ["relpos", "train", "--out", "small"]
    assert from_words(words[4:]) == small()


def test_what_cannot_be_trained_is_refused(tmp_path):
    for changes, said in (
        ({"scenarios": ""}, "--scenario: expected at least one"),
        ({"envs": "1"}, "--envs: expected at least 2"),
        ({"cars": "3"}, "--cars: expected at least 6"),
    ):
        with pytest.raises(UsageError, match=said):
            train(small(**changes), tmp_path / "run")
    assert not (tmp_path / "run").exists()
    (tmp_path / "taken").mkdir()
    (tmp_path / "taken" / "x").write_text("")
    with pytest.raises(UsageError, match="new or empty"):
        train(small(), tmp_path / "taken")
    with pytest.raises(UsageError, match="no training run"):
        export_policy(tmp_path / "taken", tmp_path / "out")
    (tmp_path / "lines").write_text('{"a": 1}\n[]\n')
    with pytest.raises(UsageError, match="line 2"):
        read_results(tmp_path / "lines", ["mine"])


def test_a_card_gets_the_summaries_of_its_own_policy_alone(tmp_path):
    rows = [
        {"policy": "mine", "episodes": 2, "formation_error": 0.1},
        {"policy": "consensus", "episodes": 2, "formation_error": 0.2},
        {"policy": "mine", "seed": 1000, "formation_error": 0.1},
    ]
    path = tmp_path / "results.jsonl"
    path.write_text("".join(json.dumps(row) + "\n" for row in rows))
    assert read_results(path, {"mine", "other"}) == rows[:1]
    with pytest.raises(UsageError, match="expected lines of other, got those of consensus, mine"):
        read_results(path, ["other"])


def test_the_share_of_episodes_with_an_operator_reaches_the_environments():
    config = small(operator="0.25")
    assert make_rooms(config, None).parts[0].formation.parts.config.operator.share == 0.25
