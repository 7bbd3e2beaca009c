"""The environment against PettingZoo's checkers and its own laws."""

import numpy as np
import pytest
from pettingzoo.test import parallel_api_test, parallel_seed_test

from agents.controllers import CONTROLLERS
from relpos_env import formation_v0
from relpos_env.errors import EnvError
from relpos_env.interface.observations import OBSERVATIONS
from relpos_env.scenarios import SCENARIOS


@pytest.mark.parametrize("observation", OBSERVATIONS)
@pytest.mark.parametrize("scenario", SCENARIOS)
def test_parallel_api(scenario, observation):
    env = formation_v0.parallel_env(scenario=scenario, observation=observation, max_cycles=40)
    parallel_api_test(env, num_cycles=60)


def test_parallel_seed():
    parallel_seed_test(lambda: formation_v0.parallel_env(max_cycles=30), num_cycles=30)


def episodes(seed, n=3, cycles=60):
    env = formation_v0.parallel_env(max_cycles=cycles)
    rng = np.random.default_rng(1)
    trace = []
    for k in range(n):
        observations, infos = env.reset(seed=seed if k == 0 else None)
        trace.append((observations, infos, env.state()))
        while env.agents:
            actions = {a: rng.uniform(-1, 1, 2).astype(np.float32) for a in env.agents}
            *step, infos = env.step(actions)
            trace.append((*step, infos, env.state()))
    return trace


def flat(value):
    if isinstance(value, dict):
        return [x for key in value for x in flat(value[key])]
    if isinstance(value, tuple):
        return [x for item in value for x in flat(item)]
    return np.asarray(value).ravel().tolist()


def test_same_seed_same_run_over_several_episodes():
    one, two = episodes(4), episodes(4)
    assert [flat(s) for s in one] == [flat(s) for s in two]
    assert [flat(s) for s in one] != [flat(s) for s in episodes(5)]


def test_episodes_differ_from_each_other():
    trace = episodes(4, n=2, cycles=20)
    assert flat(trace[0]) != flat(trace[21])


@pytest.mark.parametrize("observation", OBSERVATIONS)
def test_observations_stay_inside_their_space(observation):
    env = formation_v0.parallel_env(observation=observation, max_cycles=120)
    observations, _ = env.reset(seed=3)
    controller = CONTROLLERS["consensus"](env.fields)
    while env.agents:
        for agent, o in observations.items():
            assert env.observation_space(agent).contains(o)
        observations, *_ = env.step({a: controller.act(o) for a, o in observations.items()})
    assert sum(f.size for f in env.fields) == env.observation_space("car_0").shape[0]


def formation_error(observation, seed, blind=False):
    env = formation_v0.parallel_env(observation=observation, max_cycles=400)
    observations, _ = env.reset(seed=seed)
    controller = CONTROLLERS["consensus"](env.fields)
    trace = []
    while env.agents:
        if blind:
            for o in observations.values():
                o[:2] = 0.0  # the mask
        actions = {a: controller.act(o) for a, o in observations.items()}
        observations, _, _, _, infos = env.step(actions)
        trace.append(np.mean([i["formation_error"] for i in infos.values()]))
    return np.mean(trace[150:])


def test_the_formation_is_kept_on_estimates():
    """Better than on the operator's command alone, which an oracle beats by far."""
    seeds = range(10)  # single runs differ by a factor of three
    truth = np.mean([formation_error("truth", s) for s in seeds])
    estimate = np.mean([formation_error("estimate", s) for s in seeds])
    blind = np.mean([formation_error("estimate", s, blind=True) for s in seeds])
    assert truth < 0.2
    assert estimate < 0.8 * blind


def test_a_policy_sees_no_truth():
    """Moving the truth behind the sensors' backs leaves an observation as it is.

    All but the command, which comes from the operator, who sees the room.
    """
    for observation, sees_truth in (("estimate", False), ("truth", True)):
        env = formation_v0.parallel_env(observation=observation, max_cycles=60)
        env.reset(seed=0)
        for _ in range(50):
            env.step({a: np.array([0.4, 0.5], np.float32) for a in env.agents})
        ends = np.cumsum([f.size for f in env.fields])
        command = [f.name for f in env.fields].index("command")
        keep = np.ones(ends[-1], dtype=bool)
        keep[ends[command - 1] : ends[command]] = False
        before = env._observe()
        env.loop.state.pos_w[:] += [[0.5, 0.0], [0.0, 0.7], [-0.4, 0.2]]
        env.loop.state.vel_w[:] *= -1.0
        after = env._observe()
        changed = any(not np.array_equal(before[a][keep], after[a][keep]) for a in env.agents)
        assert changed == sees_truth


def good_actions(env):
    return {a: np.zeros(2, dtype=np.float32) for a in env.agents}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda a: a.pop("car_1"), "none for car_1"),
        (lambda a: a.update(car_1=np.zeros(3)), r"action of car_1: expected shape \(2,\)"),
        (lambda a: a.update(car_2=np.array([np.nan, 0])), "action of car_2: expected finite"),
    ],
)
def test_bad_actions_are_named(change, message):
    env = formation_v0.parallel_env(max_cycles=5)
    env.reset(seed=0)
    actions = good_actions(env)
    change(actions)
    with pytest.raises(EnvError, match=message):
        env.step(actions)


def test_actions_beyond_the_space_are_clipped():
    env = formation_v0.parallel_env(max_cycles=5)
    results = []
    for scale in (1.0, 7.0):
        env.reset(seed=0)
        observations, *_ = env.step({a: np.full(2, scale) for a in env.agents})
        results.append(flat(observations))
    assert results[0] == results[1]


@pytest.mark.parametrize(
    ("kwargs", "message"),
    [
        ({"scenario": "moon"}, "scenario: expected one of"),
        ({"observation": "all"}, "observation: expected one of"),
        ({"filter": "magic"}, "filter: expected one of"),
        ({"task": "none"}, "task: expected one of"),
        ({"n_cars": 1}, "cars: expected at least 2"),
        ({"n_cars": 99}, "do not fit"),
        ({"max_cycles": 0}, "max_cycles"),
        ({"render_mode": "human"}, "render_mode"),
    ],
)
def test_bad_arguments_are_named(kwargs, message):
    with pytest.raises(EnvError, match=message):
        formation_v0.parallel_env(**kwargs)


def test_step_before_reset():
    env = formation_v0.parallel_env()
    with pytest.raises(EnvError, match="reset"):
        env.state()
