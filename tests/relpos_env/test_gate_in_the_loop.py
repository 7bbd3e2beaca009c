"""`gate=True`: the safety gate of real cars is in the simulated loop."""

import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from relpos_env.api.gym_env import FormationGymEnv
from relpos_env.api.vector_env import FormationVectorEnv
from relpos_env.errors import EnvError
from relpos_env.formation_v0 import parallel_env


def drive(env, steps, action):
    env.reset(seed=3)
    infos = []
    for _ in range(steps):
        *_, told = env.step({a: np.array(action, np.float32) for a in env.agents})
        infos.append(told["car_0"])
    return infos


def test_speeds_are_within_the_limits_of_the_gate_and_infos_say_why():
    env = parallel_env(scenario="ring-los", gate=True)
    infos = drive(env, 60, [1.0, 0.3])
    allowed = np.array([info["allowed_speed"] for info in infos])
    assert {info["asked_speed"] for info in infos} == {2.0}
    assert 0.2 < allowed.max() <= 1.5
    assert np.abs(np.diff(allowed[allowed > 0.0])).max() <= 1.5
    held = [info for info in infos if info["allowed_speed"] < 1.4]
    assert all(info["gate"] for info in held if not info["stopped"])
    assert "asked_speed" not in drive(parallel_env(scenario="ring-los"), 1, [0.0, 0.0])[0]


def test_cars_that_head_for_each_other_do_not_touch():
    start = [[-1.5, 0.0, 0.0], [1.5, 0.0, np.pi], [0.0, 1.6, 0.0]]
    nearest = {}
    for gate in (False, True):
        env = parallel_env(scenario="ring-los", gate=gate)
        env.reset(seed=0, options={"poses": start})
        for _ in range(30):  # until the trackers have converged
            env.step({a: np.array([0.25, 0.8], np.float32) for a in env.agents})
        least = np.inf
        for _ in range(80):
            pos, heading = env.formation.state.pos_w[0], env.formation.state.heading[0]
            actions = {}
            for k, agent in enumerate(env.agents):
                other = pos[1 - k] - pos[k] if k < 2 else np.zeros(2)
                turn = np.arctan2(other[1], other[0]) - heading[k]
                turn = (turn + np.pi) % (2.0 * np.pi) - np.pi
                commanded = [0.5, np.clip(turn, -1.0, 1.0)] if k < 2 else [0.0, 0.0]
                actions[agent] = np.array(commanded, np.float32)
            env.step(actions)
            pos = env.formation.state.pos_w[0]
            least = min(least, np.linalg.norm(pos[0] - pos[1]))
        nearest[gate] = least
    assert nearest[False] < 0.45
    assert nearest[True] > 0.45


def test_a_batch_with_gates_is_its_environments():
    kwargs = {"scenario": "cars-nlos", "gate": True, "physics": "fast", "max_cycles": 30}
    batch = FormationVectorEnv(2, **kwargs)
    singles = [FormationGymEnv(**kwargs) for _ in range(2)]
    seen, _ = batch.reset(seed=5)
    for k, single in enumerate(singles):
        np.testing.assert_array_equal(single.reset(seed=5 + k)[0], seen[k])
    rng = np.random.default_rng(0)
    for _ in range(25):
        actions = rng.uniform(-1.0, 1.0, batch.action_space.shape).astype(np.float32)
        seen, *_, infos = batch.step(actions)
        for k, single in enumerate(singles):
            own, *_, info = single.step(actions[k])
            np.testing.assert_array_equal(own, seen[k])
            assert (infos["gate"][k] == info["gate"]).all()


def test_the_checker_of_gymnasium_passes():
    check_env(FormationGymEnv(gate=True, max_cycles=10), skip_render_check=True)
    with pytest.raises(EnvError, match="gate: expected bool, got 1"):
        FormationGymEnv(gate=1)


def test_an_episode_knows_nothing_of_the_one_before():
    env = FormationGymEnv(scenario="ring-los", gate=True)
    _, first = env.reset(seed=3)
    for _ in range(15):
        env.step(env.action_space.sample())
    _, again = env.reset(seed=3)
    for name in ("asked_speed", "allowed_speed", "allowed_steering", "stopped", "gate"):
        np.testing.assert_array_equal(first[name], again[name], err_msg=name)
    assert set(np.ravel(first["gate"])) == {"not armed"}
