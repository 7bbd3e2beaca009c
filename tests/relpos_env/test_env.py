"""Every task with every observation mode against the checkers of the supported libraries."""

import gymnasium
import numpy as np
import pettingzoo
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.wrappers import RecordVideo
from pettingzoo.test import api_test, parallel_api_test, parallel_seed_test, render_test
from pettingzoo.utils.wrappers import RecordVideo as RecordTurns
from pettingzoo.utils.wrappers import RecordVideoParallel
from runs import busy

from relpos_env import formation_v0
from relpos_env.api.gym_env import FormationGymEnv
from relpos_env.interface.actions import ACTIONS
from relpos_env.interface.observations import OBSERVATIONS
from relpos_env.render.renderer import RENDER_MODES
from relpos_env.tasks import TASKS

MATRIX = [(task, observation) for task in TASKS for observation in OBSERVATIONS]


@pytest.fixture(autouse=True)
def no_screen(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")


@pytest.mark.parametrize(("task", "observation"), MATRIX)
def test_pettingzoo_parallel(task, observation):
    kwargs = {"task": task, "observation": observation, "max_cycles": 12}
    parallel_api_test(formation_v0.parallel_env(**kwargs), num_cycles=30)
    parallel_seed_test(lambda: formation_v0.parallel_env(**kwargs), num_cycles=15)


@pytest.mark.parametrize(("task", "observation"), MATRIX)
def test_pettingzoo_turn_by_turn(task, observation):
    env = formation_v0.env(task=task, observation=observation, max_cycles=8)
    api_test(env, num_cycles=40)


@pytest.mark.filterwarnings("ignore:No agents present but not all:UserWarning")
@pytest.mark.filterwarnings("ignore:Observation numpy array is all zeros:UserWarning")
@pytest.mark.parametrize("actions", ACTIONS)
def test_pettingzoo_while_cars_come_and_go(actions):
    kwargs = {"scenario": busy(), "actions": actions, "history": 2, "max_cycles": 40}
    parallel_api_test(formation_v0.parallel_env(**kwargs), num_cycles=100)
    parallel_seed_test(lambda: formation_v0.parallel_env(**kwargs), num_cycles=60)
    api_test(formation_v0.env(**kwargs), num_cycles=200)


@pytest.mark.parametrize(("task", "observation"), MATRIX)
def test_gymnasium(task, observation):
    env = gymnasium.make(
        "relpos_env/Formation-v0", task=task, observation=observation, max_cycles=10
    )
    check_env(env.unwrapped, skip_render_check=True)


@pytest.mark.parametrize("actions", ACTIONS)
def test_gymnasium_in_all_render_modes(actions):
    env = gymnasium.make("relpos_env/Formation-v0", render_mode="rgb_array", actions=actions)
    check_env(env.unwrapped)
    for mode in RENDER_MODES:
        env = FormationGymEnv(render_mode=mode, max_cycles=5)
        env.reset(seed=0)
        picture = env.render()
        assert (picture is None) == (mode == "human")
        env.close()


def test_pettingzoo_render():
    render_test(lambda render_mode: formation_v0.env(render_mode=render_mode))


def test_all_are_registered():
    name = "relpos_env/formation-v0"
    parallel, turns = (pettingzoo.make(form, name, max_cycles=3) for form in ("parallel", "aec"))
    assert isinstance(parallel.unwrapped, formation_v0.parallel_env)
    turns.reset(seed=0)
    assert turns.possible_agents == parallel.possible_agents
    vector = gymnasium.make_vec("relpos_env/Formation-v0", num_envs=2, task="hold")
    assert vector.num_envs == 2


def test_gymnasium_takes_a_video(tmp_path):
    env = gymnasium.make("relpos_env/Formation-v0", render_mode="rgb_array", max_cycles=6)
    env = RecordVideo(env, str(tmp_path / "film"), episode_trigger=lambda k: k == 0)
    drive_and_close(env)
    assert len(list((tmp_path / "film").glob("*.mp4"))) == 1


def drive_and_close(env):
    env.reset(seed=0)
    over = False
    while not over:
        *_, terminated, truncated, _ = env.step(env.action_space.sample())
        over = terminated or truncated
    env.close()


def test_pettingzoo_takes_videos(tmp_path):
    env = formation_v0.parallel_env(render_mode="rgb_array", max_cycles=6)
    env = RecordVideoParallel(env, str(tmp_path / "all"), episode_trigger=lambda k: k == 0)
    env.reset(seed=0)
    while env.agents:
        env.step({a: np.zeros(2, np.float32) for a in env.agents})
    env.close()
    turns = formation_v0.raw_env(render_mode="rgb_array", max_cycles=3)
    turns = RecordTurns(turns, str(tmp_path / "turns"), episode_trigger=lambda k: k == 0)
    turns.reset(seed=0)
    for agent in turns.agent_iter():
        *_, terminated, truncated, _ = turns.last()
        turns.step(None if terminated or truncated else turns.action_space(agent).sample())
    turns.close()
    for folder in ("all", "turns"):
        assert len(list((tmp_path / folder).glob("*.mp4"))) == 1
