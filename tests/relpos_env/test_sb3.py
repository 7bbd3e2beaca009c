"""Stable-Baselines3: its checker, training on every task, agent slots as PettingZoo agents."""

import numpy as np
import pytest
from runs import bits, busy, slots_run

pytest.importorskip("stable_baselines3")

from stable_baselines3 import PPO
from stable_baselines3.common.env_checker import check_env
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.vec_env import SubprocVecEnv, VecMonitor, VecNormalize

from relpos_env.api.gym_env import FormationGymEnv
from relpos_env.api.sb3_vec_env import FormationVecEnv
from relpos_env.errors import EnvError
from relpos_env.formation_v0 import parallel_env
from relpos_env.interface.actions import ACTIONS
from relpos_env.interface.observations import OBSERVATIONS
from relpos_env.tasks import TASKS

MATRIX = [(task, observation) for task in TASKS for observation in OBSERVATIONS]
BUSY = {"scenario": busy(), "max_cycles": 40}


def learn(env, n_steps=8):
    model = PPO(
        "MlpPolicy", env, n_steps=n_steps,
        batch_size=n_steps * env.num_envs, n_epochs=1, seed=0, device="cpu",
        policy_kwargs={"net_arch": [8]},
    )  # fmt: skip
    model.learn(2 * n_steps * env.num_envs)
    return model


@pytest.mark.parametrize("actions", ACTIONS)
@pytest.mark.parametrize("task", TASKS)
def test_checker(task, actions):
    check_env(FormationGymEnv(task=task, actions=actions, max_cycles=20))


@pytest.mark.parametrize(("task", "observation"), MATRIX)
def test_training(task, observation):
    env = FormationVecEnv(2, task=task, observation=observation, max_cycles=6)
    model = learn(env)
    action, _ = model.predict(env.reset())
    assert action.shape == (env.num_envs, 2)


@pytest.mark.parametrize("actions", ACTIONS)
def test_training_while_cars_come_and_go(actions):
    env = FormationVecEnv(3, threads=2, history=2, actions=actions, **BUSY)
    model = learn(VecNormalize(VecMonitor(env)), n_steps=48)
    assert len(model.ep_info_buffer) > 0
    env.close()


@pytest.mark.parametrize("kwargs", [BUSY, {"max_cycles": 15, "actions": "discrete"}])
def test_same_seed_same_run(kwargs):
    runs = [
        bits(slots_run(FormationVecEnv(3, threads=threads, **kwargs), seed, 100)[0])
        for seed, threads in ((4, 1), (4, 2), (5, 1))
    ]
    assert runs[0] == runs[1] != runs[2]


@pytest.mark.parametrize(
    "kwargs", [BUSY, {**BUSY, "end_on_collision": True, "observation": "estimate_cov"}]
)
def test_seats_are_the_agents_of_the_pettingzoo_form(kwargs):
    vec = FormationVecEnv(2, **kwargs)
    trace, taken = slots_run(vec, 30, 120)
    n, left = vec.n_cars, 0
    for e in range(2):
        env = parallel_env(**kwargs)
        rows = slice(e * n, (e + 1) * n)
        observations, _ = env.reset(seed=30 + e)
        check_slots(env, observations, trace[0][rows])
        for (seen, rewards, dones, infos), actions in zip(trace[1:], taken, strict=True):
            slots = {f"car_{k}": row for k, row in enumerate(range(n * e, n * e + n))}
            commanded = {a: actions[slots[a]] for a in env.agents}
            observations, reward, terminated, truncated, told = env.step(commanded)
            for agent, row in slots.items():
                assert rewards[row] == np.float32(reward.get(agent, 0.0))
                over = terminated.get(agent, False) or truncated.get(agent, False)
                assert dones[row] == (over or not env.agents)
                if over:
                    last = infos[row]["terminal_observation"]
                    assert bits(last) == bits(observations[agent])
                    assert {key: infos[row][key] for key in told[agent]} == told[agent]
                    assert infos[row]["TimeLimit.truncated"] == (not terminated[agent])
            left += bool(env.agents) and any(truncated.values())
            if not env.agents:
                observations, _ = env.reset()
            check_slots(env, observations, seen[rows])
    assert left > 0


def check_slots(env, observations, rows):
    for agent, row in zip(env.possible_agents, rows, strict=True):
        if agent in env.agents:
            assert bits(row) == bits(observations[agent])
        else:
            assert not row.any()


def test_seats_without_a_car_are_marked():
    env = FormationVecEnv(2, **BUSY)
    env.seed(3)
    env.reset()
    for _ in range(20):
        *_, infos = env.step(np.zeros((env.num_envs, 2), np.float32))
        for slot in np.nonzero(~env.active)[0]:
            assert infos[slot].get("active") is False or "terminal_observation" in infos[slot]
        for slot in np.nonzero(env.active)[0]:
            assert "active" not in infos[slot]


def test_in_processes_of_its_own():
    env = make_vec_env(
        FormationGymEnv,
        n_envs=2,
        seed=3,
        env_kwargs={"max_cycles": 5},
        vec_env_cls=SubprocVecEnv,
        vec_env_kwargs={"start_method": "spawn"},
    )
    single = FormationGymEnv(max_cycles=5)
    observation, _ = single.reset(seed=4)
    rows = env.reset()
    actions = np.full((2, 6), 0.3, np.float32)
    for _ in range(8):
        assert bits(rows[1]) == bits(observation)
        rows, rewards, dones, _ = env.step(actions)
        observation, reward, terminated, truncated, _ = single.step(actions[1])
        assert dones[1] == (terminated or truncated)
        assert rewards[1] == pytest.approx(reward, rel=1e-6)
        if dones[1]:
            observation, _ = single.reset()
    env.close()


def test_seats_take_options_for_their_rooms():
    env = FormationVecEnv(scenario="ring-los", n_envs=2)
    poses = [[x, 0.0, 0.0] for x in (-1.0, 0.0, 1.0)]
    env.set_options({"poses": poses})
    env.reset()
    state = env.formation.state
    assert np.allclose(state.pos_w[:, :3, 0], [-1.0, 0.0, 1.0], atol=0.05)
    env.reset()
    assert not np.allclose(state.pos_w[:, :3, 0], [-1.0, 0.0, 1.0], atol=0.05)
    env.set_options({"nonsense": 1})
    with pytest.raises(EnvError, match="options: expected names among"):
        env.reset()
