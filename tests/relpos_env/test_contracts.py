"""Contracts of the interfaces beyond their libraries' checkers."""

from dataclasses import replace

import gymnasium
import numpy as np
import pytest
from gymnasium.wrappers.vector import FlattenObservation, NormalizeObservation
from pettingzoo.test import parallel_api_test
from runs import busy

from relpos_env.api.gym_env import FormationGymEnv
from relpos_env.api.vector_env import FormationVectorEnv
from relpos_env.errors import EnvError, UnknownArgument
from relpos_env.formation_v0 import parallel_env
from relpos_env.scenarios import SCENARIOS

POSES = [[-1.5, 0.0, 0.0], [1.5, 0.0, 3.0], [0.0, -1.5, 1.0]]
KEYS = {
    "formation_error", "tracking_error", "disagreement", "tracked", "collisions", "present",
    "active",
}  # fmt: skip


def still(env):
    return {agent: np.zeros(2, np.float32) for agent in env.agents}


def test_cars_start_and_stand_where_they_are_asked_to():
    env = parallel_env(task="hold", scenario="ring-los", max_cycles=300)
    goals = [[-1.0, 0.5], [1.0, 0.5], [0.0, -0.8]]
    env.reset(seed=1, options={"poses": POSES, "goals": goals})
    np.testing.assert_allclose(env.formation.state.pos_w[0], np.array(POSES)[:, :2], atol=0.02)
    np.testing.assert_allclose(env.formation.task.goal_w[0], goals, atol=1e-12)
    expected = np.array(goals)[None, :] - np.array(goals)[:, None]
    np.testing.assert_allclose(env.formation.task.target[0], expected, atol=1e-12)
    env.reset()
    assert np.abs(env.formation.state.pos_w[0] - np.array(POSES)[:, :2]).max() > 0.1
    meeting = FormationGymEnv(task="rendezvous")
    meeting.reset(seed=1, options={"goals": [1.0, -1.0]})
    assert (meeting.unwrapped.formation.task.goal_w[0] == [1.0, -1.0]).all()


def test_an_episode_may_have_another_scenario_of_the_same_room():
    env = FormationVectorEnv(2, scenario="ring-nlos")
    env.reset(seed=1, options={"scenario": "ring-los"})
    assert not (env.formation.loop.swarm.boxes[..., 2] > 0.0).any()
    env.reset()
    assert (env.formation.loop.swarm.boxes[..., 2] > 0.0).any()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"pose": []}, "options: expected names among poses, goals, scenario, got 'pose'"),
        ({"poses": [[0.0, 0.0]]}, r"poses: expected finite numbers, \(car, 3\)"),
        ({"poses": [[0.0, 0.0, np.nan]] * 3}, "poses: expected finite numbers"),
        ({"poses": [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]]}, "poses: cars 0 and 1 overlap"),
        ({"poses": [[0.0, 1.0, 0.0], [9.0, 0.0, 0.0]]}, "poses: car 1 is in a wall"),
        ({"poses": [*POSES, *POSES]}, "poses: expected 2 to 3 cars, got 6"),
        ({"goals": [0.0, 0.0]}, "goals: expected none, the task has"),
        ({"scenario": "hall"}, "scenario: expected a room of"),
        ({"scenario": "nowhere"}, "scenario: expected one of"),
    ],
)
def test_wishes_that_cannot_be_are_named(options, message):
    for env in (parallel_env(), FormationGymEnv(), FormationVectorEnv(2)):
        with pytest.raises(EnvError, match=message):
            env.reset(seed=0, options=options)


def test_steps_after_the_end_and_unknown_agents_are_refused():
    env = parallel_env(max_cycles=1)
    env.reset(seed=0)
    with pytest.raises(EnvError, match="actions: expected agents among car_0, .* got 'car_9'"):
        env.step({**still(env), "car_9": np.zeros(2, np.float32)})
    actions = still(env)
    env.step(actions)
    assert env.step({}) == ({}, {}, {}, {}, {})
    with pytest.raises(EnvError, match="the episode is over"):
        env.step(actions)
    team = FormationGymEnv(max_cycles=1)
    team.reset(seed=0)
    team.step(team.action_space.sample())
    with pytest.raises(EnvError, match="the episode is over"):
        team.step(team.action_space.sample())
    with pytest.raises(UnknownArgument, match="unexpected keyword argument 'frameskip'") as caught:
        FormationGymEnv(frameskip=4)
    assert isinstance(caught.value, TypeError)


def test_infos_have_the_same_keys_at_every_step_in_every_form():
    kwargs = {"scenario": busy(), "max_cycles": 30}
    env, team = parallel_env(**kwargs), FormationGymEnv(**kwargs)
    batch = FormationVectorEnv(2, **kwargs)
    infos = [*env.reset(seed=0)[1].values(), team.reset(seed=0)[1]]
    terms = {f"reward_{term}" for term in env.formation.task.terms}
    infos.append({k: v for k, v in batch.reset(seed=0)[1].items() if k[0] != "_"})
    while env.agents:
        *_, told = env.step(still(env))
        infos += list(told.values())
        assert not any(isinstance(value, dict) for info in told.values() for value in info.values())
    assert {frozenset(info) for info in infos} == {frozenset(KEYS | terms | {"is_success"})}
    absent = [info for info in infos[:-2] if not np.all(info["present"])]
    assert absent
    assert all(np.isinf(info["formation_error"]) for info in absent if info["present"] is False)


def test_a_car_that_leaves_has_its_last_observation():
    env = parallel_env(scenario=busy(), max_cycles=200)
    before, _ = env.reset(seed=0)
    gone = 0
    while env.agents:
        observations, rewards, ends, stops, _ = env.step(still(env))
        for agent in stops:
            if agent not in env.agents and env.agents:
                assert stops[agent]
                np.testing.assert_array_equal(observations[agent], before[agent])
                assert observations[agent].any()
                gone += 1
        before = observations
    assert gone > 0


def test_agents_that_are_fixed_neither_come_nor_go():
    kwargs = {"scenario": busy(), "max_cycles": 40}
    env, free = parallel_env(fixed_agents=True, **kwargs), parallel_env(**kwargs)
    parallel_api_test(parallel_env(fixed_agents=True, **kwargs), num_cycles=100)
    observations, _ = env.reset(seed=0)
    seen, _ = free.reset(seed=0)
    absent = 0
    while True:
        assert set(observations) == set(env.possible_agents)
        for agent, row in observations.items():
            present = bool(env.formation.state.present[0, env.possible_agents.index(agent)])
            absent += not present
            assert row[-1] == present
            assert env.observation_space(agent).contains(row)
            if present:
                np.testing.assert_array_equal(row[:-1], seen[agent])
            else:
                assert not row.any()
        if not env.agents:
            break
        assert env.agents == env.possible_agents
        actions = still(env)
        observations, rewards, *_ = env.step(actions)
        seen, other, *_ = free.step({a: actions[a] for a in free.agents})
        assert {a: rewards[a] for a in other} == other
    assert absent > 0
    assert env.fields[-1].name == "present"


def test_the_state_is_inside_its_space():
    env = parallel_env(scenario=busy(), max_cycles=60)
    env.reset(seed=0)
    rng = np.random.default_rng(0)
    while env.agents:
        assert env.state_space.contains(env.state())
        env.step({a: rng.uniform(-1, 1, 2).astype(np.float32) for a in env.agents})
    assert np.isfinite(env.state_space.high).all()


def test_tools_find_the_length_of_episodes_and_wrap_vectors():
    assert gymnasium.make("relpos_env/Formation-v0", max_cycles=50).spec.max_episode_steps == 50
    assert parallel_env(max_cycles=7).max_episode_steps == 7
    env = gymnasium.make_vec("relpos_env/Formation-v0", num_envs=2, max_episode_steps=3)
    assert env.get_wrapper_attr("max_episode_steps") == 3 if hasattr(env, "get_wrapper_attr") else 3
    wrapped = NormalizeObservation(FlattenObservation(env))
    wrapped.reset(seed=0)
    for _ in range(3):
        *_, stops, _ = wrapped.step(wrapped.action_space.sample())
    assert stops.all()
    with pytest.raises(EnvError, match="autoreset_mode: expected one of NextStep, SameStep"):
        FormationVectorEnv(2, autoreset_mode="never")


def test_all_that_end_together_begin_in_one_go(monkeypatch):
    env = FormationVectorEnv(8, max_cycles=3)
    env.reset(seed=0)
    sizes = []
    swarm = type(env.formation.loop.swarm)
    step = swarm.step
    monkeypatch.setattr(swarm, "step", lambda s, *a: (sizes.append(s.n_envs), step(s, *a))[1])
    for _ in range(4):
        env.step(env.action_space.sample())
    assert set(sizes) == {8}


def test_a_scenario_with_a_gap_is_no_other_room():
    env = parallel_env(scenario="gap", task="gap")
    with pytest.raises(EnvError, match="scenario: expected"):
        env.reset(options={"scenario": SCENARIOS["hall"]})


@pytest.mark.parametrize("name", ["furnish", "n_waves", "antenna_height"])
def test_an_episode_has_no_other_scenario_in_parts(name):
    made = SCENARIOS["ring-los"]
    wished = {
        "furnish": lambda: replace(made, furnish=lambda world, rng: None),
        "n_waves": lambda: replace(made, mag=replace(made.mag, n_waves=24)),
        "antenna_height": lambda: replace(made, radio=replace(made.radio, antenna_height=1.5)),
    }[name]()
    env = parallel_env(scenario="ring-los")
    with pytest.raises(EnvError, match="scenario: expected the .* of the environment"):
        env.reset(options={"scenario": wished})


@pytest.mark.parametrize("make", [FormationGymEnv, parallel_env])
def test_after_a_wish_that_cannot_be_there_is_no_episode(make):
    env = make(scenario="ring-los", task="hold")
    env.reset(seed=1)
    with pytest.raises(EnvError, match="goals"):
        env.reset(options={"goals": [[0.0, 0.0]]})
    with pytest.raises(EnvError, match="must be reset first"):
        env.step({} if make is parallel_env else np.zeros(env.action_space.shape, np.float32))


def test_a_reward_term_is_asked_after_steps_alone():
    asked = []

    def term(formation):
        asked.append(formation.cycles.copy())
        return np.ones((formation.n_envs, formation.parts.n_cars)) / formation.cycles[:, None]

    env = FormationVectorEnv(2, scenario="ring-los", reward=term)
    env.reset(seed=1)
    assert asked == []
    env.step(env.action_space.sample())
    assert len(asked) == 1
