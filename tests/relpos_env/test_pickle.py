"""Copies of running environments continue bit for bit, here and in other processes."""

import copy
import multiprocessing
import pickle
from functools import partial

import numpy as np
import pytest
from gymnasium.vector import AsyncVectorEnv
from runs import bits, busy, commands, parallel_run, run_of_seed

from relpos_env import formation_v0
from relpos_env.api.gym_env import FormationGymEnv
from relpos_env.api.vector_env import FormationVectorEnv
from relpos_env.formation_v0 import parallel_env
from relpos_env.scenarios import SCENARIOS

BUSY = {"scenario": busy(), "max_cycles": 40, "history": 2}
COPIES = {"pickle": lambda env: pickle.loads(pickle.dumps(env)), "deepcopy": copy.deepcopy}


def go_on(env, rng, steps):
    """Return all results of some more steps, over the ends of episodes."""
    trace, parallel = [], hasattr(env, "agents")
    shape = (env.num_envs,) if hasattr(env, "num_envs") else ()
    for _ in range(steps):
        if parallel:
            step = env.step({a: commands(env.action_space(a), rng) for a in env.agents})
            over = not env.agents
        else:
            space = getattr(env, "single_action_space", env.action_space)
            step = env.step(commands(space, rng, shape))
            over = not shape and (step[2] or step[3])
        trace.append(bits(step))
        if over:
            trace.append(bits(env.reset()))
    return trace


def check_copy(env, make_copy, steps=60):
    env.reset(seed=3)
    rng = np.random.default_rng(1)
    go_on(env, rng, 15)
    # Contacts at the time of the copy are solved again, not bit for bit.
    while env.formation.loop.swarm._bodies.calm.any():
        go_on(env, rng, 1)
    twin = make_copy(env)
    runs = [go_on(each, np.random.default_rng(2), steps) for each in (env, twin)]
    assert runs[0] == runs[1]


@pytest.mark.parametrize("way", COPIES)
@pytest.mark.parametrize(
    "make",
    [
        partial(parallel_env, **BUSY),
        partial(FormationGymEnv, **BUSY),
        partial(FormationVectorEnv, 3, **BUSY),
        partial(FormationVectorEnv, 3, threads=2, **BUSY),
        partial(FormationGymEnv, task="follow", observation="estimate_cov"),
    ],
)
def test_a_copy_in_mid_episode_goes_on_bit_for_bit(make, way):
    check_copy(make(), COPIES[way])


def test_a_copy_of_the_seats_goes_on_bit_for_bit():
    pytest.importorskip("stable_baselines3")
    from relpos_env.api.sb3_vec_env import FormationVecEnv

    env = FormationVecEnv(2, threads=2, **BUSY)
    env.seed(3)
    env.reset()
    rng = np.random.default_rng(0)
    actions = commands(env.action_space, rng, (100, env.num_envs))
    for copied_at, row in enumerate(actions):
        env.step(row)
        if copied_at > 15 and not env.formation.loop.swarm._bodies.calm.any():
            break
    twin = pickle.loads(pickle.dumps(env))
    for row in actions[copied_at + 1 :]:
        assert bits(env.step(row)) == bits(twin.step(row))


def test_an_environment_that_was_drawn_can_be_copied():
    env = FormationGymEnv(render_mode="rgb_array")
    env.reset(seed=0)
    picture = env.render()
    twin = pickle.loads(pickle.dumps(env))
    assert np.array_equal(twin.render(), picture)


def test_an_environment_that_records_can_be_copied():
    env = parallel_env(record=True, max_cycles=10)
    env.reset(seed=0)
    env.step({a: np.zeros(2) for a in env.agents})
    twin = pickle.loads(pickle.dumps(env))
    logs = [each.recorded_log("x") for each in (env, twin)]
    assert bits(logs[0].block.values) == bits(logs[1].block.values)


def test_the_turn_by_turn_form_can_be_copied():
    env = formation_v0.env(max_cycles=10)
    env.reset(seed=0)
    twin = copy.deepcopy(env)
    for each in (env, twin):
        for agent in each.agent_iter(12):
            each.step(np.full(2, 0.1 * each.agents.index(agent), np.float32))
    assert bits(env.last()[:2]) == bits(twin.last()[:2])


@pytest.mark.parametrize("context", ["spawn", "fork"])
def test_in_processes_of_gymnasium(context):
    make = partial(FormationGymEnv, max_cycles=4)
    env = AsyncVectorEnv([make, make], context=context)
    observations, _ = env.reset(seed=5)
    single = make()
    seen, _ = single.reset(seed=6)
    assert bits(observations[1]) == bits(seen)
    for _ in range(3):
        observations, rewards, *_ = env.step(np.full((2, 6), 0.2, np.float32))
        seen, reward, *_ = single.step(np.full(6, 0.2, np.float32))
        assert bits(observations[1]) == bits(seen)
        assert rewards[1] == reward
    env.close()


def test_in_a_process_that_starts_from_nothing():
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        elsewhere = pool.map(run_of_seed, [4])
    assert elsewhere == [run_of_seed(4)]


def test_a_scenario_goes_through_a_pickle():
    chosen = SCENARIOS["hall"].at_level(4)
    same = pickle.loads(pickle.dumps(chosen))
    runs = [parallel_run(parallel_env(scenario=s, max_cycles=5), 1) for s in (chosen, same)]
    assert runs[0] == runs[1]
