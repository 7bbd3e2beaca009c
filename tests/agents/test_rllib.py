"""Environment and training of RLlib; they need the extra `rllib`."""

import json
import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

pytest.importorskip("ray", reason="ray is not installed: pip install -e '.[rllib]'")
pytest.importorskip("tree", reason="RLlib is not installed: pip install -e '.[rllib]'")
pytest.importorskip("torch", reason="torch is not installed: pip install -e '.[rllib]'")

import torch
from ray.rllib.core.columns import Columns
from ray.rllib.core.rl_module.rl_module import RLModule
from ray.rllib.env.env_context import EnvContext
from ray.rllib.env.multi_agent_env_runner import MultiAgentEnvRunner
from ray.rllib.env.multi_agent_episode import MultiAgentEpisode
from ray.rllib.utils.pre_checks.env import check_multiagent_environments

from agents.comparison.compare import compare
from agents.errors import UsageError
from agents.policies import load_policy
from agents.policies.layout import Layout
from agents.rllib.config import RllibConfig
from agents.rllib.env import OWN_SEEDS, FormationMultiAgentEnv, SeededEnv
from agents.rllib.train import MODULE, ppo_config, rllib_train
from relpos_env.api.parallel_env import FormationEnv
from relpos_env.core import env_core as formation
from relpos_env.scenarios import SCENARIOS, draw_episode
from relpos_env.scenarios.life import LifeEvent
from relpos_env.timing import STAND_STILL

# RLlib and Ray warn about their own deprecations, and leave sockets to the garbage collector.
pytestmark = [
    pytest.mark.filterwarnings("ignore::DeprecationWarning"),
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
    pytest.mark.filterwarnings("ignore::UserWarning:ray.*"),
    pytest.mark.filterwarnings("ignore::FutureWarning"),
]

LIVELY = {"scenario": "cars-nlos", "level": 4, "max_cycles": 150}
"""Configuration in which cars join, leave and return."""


def test_rllibs_own_check_passes():
    check_multiagent_environments(FormationMultiAgentEnv(LIVELY))


@pytest.fixture
def come_and_go(monkeypatch):
    """Use episodes in which car 3 joins, car 1 leaves and returns and car 2 leaves for good."""
    happens = ((2.0, 3, "join"), (3.0, 1, "leave"), (4.5, 2, "leave"), (6.0, 1, "join"))

    def draw(scenario, n_slots, seconds, rng):
        episode = draw_episode(scenario, n_slots, seconds, rng)
        present, events = episode.present.copy(), []
        present[3] = False
        for t, car, what in happens:
            pose = tuple(episode.start[car]) if what == "join" else None
            events.append(LifeEvent(t=STAND_STILL + t, car=car, what=what, pose=pose))
        return replace(episode, present=present, events=tuple(events))

    monkeypatch.setattr(formation, "draw_episode", draw)
    return {"scenario": "hall", "n_cars": 4, "max_cycles": 80}


def drive(seed, arguments=LIVELY):
    """Drive the RLlib form and the PettingZoo form with the same random actions, side by side."""
    ours, theirs = FormationMultiAgentEnv(arguments), FormationEnv(**arguments)
    rng = np.random.default_rng(seed)
    (observations, infos), (expected, _) = ours.reset(seed=seed), theirs.reset(seed=seed)
    yield theirs, (observations, {}, {}, {}, infos), (expected, {}, {}, {}, _)
    over = False
    while not over:
        actions = {a: rng.uniform(-1, 1, 2).astype(np.float32) for a in observations}
        # Actions of agents without observation are arbitrary, and have no effect.
        others = {a: rng.uniform(-1, 1, 2).astype(np.float32) for a in theirs.agents}
        found = ours.step({a: v for a, v in actions.items() if a in theirs.agents})
        expected = theirs.step({**others, **{a: v for a, v in actions.items() if a in others}})
        observations = found[0]
        over = found[2]["__all__"] or found[3]["__all__"]
        yield theirs, found, expected


@settings(max_examples=8)
@given(st.integers(0, 10_000))
def test_every_key_has_the_value_of_the_pettingzoo_form(seed):
    check_keys(drive(seed))


def test_so_have_those_of_a_day_on_which_everything_happens(come_and_go):
    check_keys(drive(0, come_and_go))


def check_keys(steps):
    left, before = set(), None
    for theirs, found, expected in steps:
        observations, rewards, terminated, truncated, infos = found
        for agent, row in observations.items():
            assert row.tobytes() == expected[0][agent].tobytes()
            assert infos[agent] == expected[4][agent]
            if before is not None:
                assert rewards[agent] == expected[1][agent]
                assert terminated[agent] == expected[2][agent]
                assert truncated[agent] == expected[3][agent]
        over = not theirs.agents
        missing = set(expected[0]) - set(observations)
        # Exactly the agents that are away.
        away = {a for a, info in expected[4].items() if not info["present"]}
        ending = {a for a, cut in expected[3].items() if cut}
        assert missing == (set() if over else away - ending)
        assert not left & set(observations)
        left |= ending if before is not None else set()
        if before is not None:
            assert set(rewards) == set(observations) == set(infos)
            assert set(terminated) == set(truncated) == {*observations, "__all__"}
            assert (terminated["__all__"] or truncated["__all__"]) == over
        before = found
    assert not theirs.agents


def test_episodes_of_rllib_take_joins_leaves_and_returns(come_and_go):
    env = FormationMultiAgentEnv(come_and_go)
    rng = np.random.default_rng(0)
    episode = MultiAgentEpisode(agent_to_module_mapping_fn=lambda *_, **__: MODULE)
    observations, infos = env.reset(seed=0)
    episode.add_env_reset(observations=observations, infos=infos)
    before, story = set(observations), []
    while not episode.is_done:
        assert episode.get_agents_to_act() == before
        actions = {a: rng.uniform(-1, 1, 2).astype(np.float32) for a in before}
        observations, rewards, ended, cut, infos = env.step(actions)
        episode.add_env_step(
            observations=observations,
            actions=actions,
            rewards=rewards,
            infos=infos,
            terminateds=ended,
            truncateds=cut,
        )
        now = {a for a in observations if not cut[a]}
        if not cut["__all__"]:
            story += [f"+{a}" for a in now - before] + [f"-{a}" for a in before - now]
        before = now
    episode.validate()
    assert story == ["+car_3", "-car_1", "-car_2", "+car_1"]
    lengths = {a: len(car) for a, car in episode.agent_episodes.items()}
    assert lengths["car_0"] == len(episode) == 80
    assert lengths["car_3"] == 80 - 21
    assert lengths["car_2"] == 46
    # The step in which it left and that in which it was observed again are one.
    assert lengths["car_1"] == 80 - 30
    assert episode.agent_episodes["car_2"].is_truncated


def test_runners_never_share_an_episode_and_leave_those_of_comparisons_alone(monkeypatch):
    seeds = []
    reset = FormationEnv.reset

    def told(self, seed=None, options=None):
        seeds.append(seed)
        return reset(self, seed, options)

    monkeypatch.setattr(FormationEnv, "reset", told)

    def begun(worker, place, again=False):
        context = EnvContext({"arguments": LIVELY, "seed": 3}, worker, recreated_worker=again)
        env = SeededEnv(context)
        # As in RLlib, whose seeds of neighbours are equal.
        return [env.reset(seed=3 + worker + place)[0]["car_0"].tobytes() for _ in range(2)]

    first = begun(1, 0)
    rows = [*first, *begun(1, 1), *begun(2, 0), *begun(2, 1), *begun(1, 0, again=True)]
    assert len(set(rows)) == len(rows) == 10
    assert begun(1, 0) == first
    assert all(seed is None or seed >= OWN_SEEDS for seed in seeds)


def test_an_env_runner_samples_whole_episodes_on_one_network(come_and_go):
    config = RllibConfig(arguments=come_and_go, workers=0, envs=2, steps=300)
    runner = MultiAgentEnvRunner(config=ppo_config(config), worker_index=0)
    try:
        assert list(runner.module.keys()) == [MODULE]
        episodes = runner.sample(num_episodes=3)
        assert len(episodes) == 3
        for episode in episodes:
            assert episode.is_done
            assert set(episode.agent_episodes) == {f"car_{k}" for k in range(4)}
            for car in episode.agent_episodes.values():
                assert car.module_id == MODULE
                assert np.isfinite(car.get_observations()).all()
                assert len(car.get_actions()) == len(car.get_rewards())
    finally:
        runner.stop()


def test_training_on_two_runners_gives_a_policy_that_drives(tmp_path):
    config = RllibConfig(arguments=LIVELY, iterations=1, workers=2, envs=2, steps=640, width=16)
    told = []
    result = rllib_train(config, tmp_path / "run", progress=told.append)
    assert told == result.records
    lines = (tmp_path / "run" / "training.jsonl").read_text().splitlines()
    assert [json.loads(line) for line in lines] == result.records
    assert [r["iteration"] for r in result.records] == [1]
    last = result.records[-1]
    assert last["env_steps"] >= 640
    assert last["episodes"] >= 4
    assert np.isfinite(last["return"])
    assert last["formation_error"] > 0.0
    assert last["env_steps_per_s"] > 0.0

    policy = load_policy(str(result.policy))
    assert policy.layout == Layout("estimate", config.layout.n_cars)
    assert policy.card.training["measured"] == last
    # The file drives as RLlib's network from the checkpoint.
    path = result.checkpoint / "learner_group" / "learner" / "rl_module" / MODULE
    module = RLModule.from_checkpoint(str(path.resolve()))
    rows = np.random.default_rng(0).normal(0, 3, (50, policy.layout.size)).astype(np.float32)
    with torch.no_grad():
        out = module.forward_inference({Columns.OBS: torch.from_numpy(rows)})
    mean = out[Columns.ACTION_DIST_INPUTS][:, :2].clamp(-1, 1).numpy()
    assert np.abs(policy.act(rows) - mean).max() < 1e-5
    assert np.abs(mean).max() > 1e-3
    again = compare(
        drivers=[str(result.policy)], scenarios=["cars-nlos"], episodes=1, seconds=2.0, settle=1.0
    )
    assert np.isfinite(again.records[0]["formation_error"])


def test_numbers_out_of_range_and_actions_that_it_cannot_learn_are_refused():
    with pytest.raises(UsageError, match="--workers: expected 0 to 4096, got 5000"):
        RllibConfig(workers=5000)
    with pytest.raises(UsageError, match="actions: expected 'continuous', got 'discrete'"):
        _ = RllibConfig(arguments={"actions": "discrete"}).layout


@pytest.mark.parametrize(
    ("name_or_path", "told"),
    [
        (Path("rooms/mine.toml"), str(Path("rooms/mine.toml"))),
        (SCENARIOS["cars-nlos"], "cars-nlos"),
        ("cars-los", "cars-los"),
    ],
)
def test_what_is_recorded_of_a_scenario_is_text(name_or_path, told):
    record = RllibConfig(arguments={"scenario": name_or_path, "task": "hold"}).record
    assert json.loads(json.dumps(record))["arguments"] == {"scenario": told, "task": "hold"}


def test_the_configuration_goes_to_other_machines():
    config = ppo_config(RllibConfig(arguments=LIVELY))
    assert len(pickle.dumps(config.env_config)) < 10_000
