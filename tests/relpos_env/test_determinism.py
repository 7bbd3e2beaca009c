"""Equal seeds give equal bits in every form; a batch equals its environments alone."""

from functools import partial

import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from runs import bits, busy, commands, gym_run, parallel_run, vector_run

from relpos_env.api.gym_env import FormationGymEnv
from relpos_env.api.vector_env import FormationVectorEnv
from relpos_env.errors import EnvError
from relpos_env.formation_v0 import parallel_env

HARD = {"scenario": "random", "level": 4, "n_cars": 5, "max_cycles": 30}
BUSY = {"scenario": busy(), "max_cycles": 30, "observation": "estimate_cov"}
"""Configuration with joins, leaves, power losses and all kinds of randomisation."""


@pytest.mark.parametrize("kwargs", [HARD, BUSY, {"max_cycles": 20, "actions": "discrete"}])
def test_same_seed_same_run_over_several_episodes(kwargs):
    one, two, other = (parallel_run(parallel_env(**kwargs), seed) for seed in (4, 4, 5))
    assert one == two
    assert one != other


def test_a_used_environment_is_as_good_as_a_new_one():
    env = parallel_env(**BUSY)
    first = parallel_run(env, 4)
    parallel_run(env, 11)
    assert parallel_run(env, 4) == first


def test_episodes_differ_from_each_other():
    env = FormationGymEnv(max_cycles=20)
    first, _ = env.reset(seed=1)
    second, _ = env.reset()
    assert bits(first) != bits(second)


@pytest.mark.parametrize("kwargs", [HARD, BUSY])
def test_same_seed_same_run_of_the_gymnasium_form(kwargs):
    one, two, other = (gym_run(FormationGymEnv(**kwargs), seed) for seed in (4, 4, 5))
    assert one == two
    assert one != other


def test_the_busy_scenario_has_joins_leaves_and_losses_of_power():
    env = parallel_env(**BUSY)
    seen = set()
    for k in range(4):
        env.reset(seed=4 if k == 0 else None)
        before = env.formation.state.present.copy(), env.loop.swarm.powered.copy()
        while env.agents:
            env.step({a: np.zeros(2) for a in env.agents})
            now = env.formation.state.present.copy(), env.loop.swarm.powered.copy()
            for name, was, is_now in zip(("present", "power"), before, now, strict=True):
                seen |= {(name, "on")} if (is_now & ~was).any() else set()
                seen |= {(name, "off")} if (was & ~is_now).any() else set()
            before = now
    assert len(seen) == 4


@pytest.mark.parametrize(
    ("n_envs", "kwargs"),
    [
        (1, BUSY),
        (3, BUSY),
        (5, {**HARD, "max_cycles": 20}),
        (3, {**BUSY, "history": 3, "observation": "ranges", "actions": "discrete"}),
        (3, {**BUSY, "end_on_collision": True, "max_cycles": 60}),
    ],
)
@pytest.mark.parametrize("mode", AutoresetMode)
def test_a_vector_is_the_sync_vector_of_single_ones(n_envs, kwargs, mode):
    kwargs = {**kwargs, "physics": "fast"}
    ours = FormationVectorEnv(n_envs, autoreset_mode=mode, **kwargs)
    theirs = SyncVectorEnv([partial(FormationGymEnv, **kwargs)] * n_envs, autoreset_mode=mode)
    assert ours.metadata["autoreset_mode"] is theirs.metadata["autoreset_mode"]
    assert bits(ours.reset(seed=20)) == bits(theirs.reset(seed=20))
    space, rng, ends = ours.single_action_space, np.random.default_rng(7), 0
    for _ in range(70):
        actions = commands(space, rng, (n_envs,))
        mine, his = ours.step(actions), theirs.step(actions)
        assert bits(mine) == bits(his)
        over = mine[2] | mine[3]
        ends += over.sum()
        if mode is AutoresetMode.DISABLED and over.any():
            with pytest.raises(EnvError, match=r"environment \d is over, it must be reset"):
                ours.step(actions)
            resets = [env.reset(options={"reset_mask": over.copy()}) for env in (ours, theirs)]
            assert bits(resets[0]) == bits(resets[1])
    assert ends >= n_envs


def test_one_seed_is_one_series_of_episodes_in_every_form():
    pytest.importorskip("stable_baselines3")
    from relpos_env.api.sb3_vec_env import FormationVecEnv

    kwargs = {"physics": "fast", "max_cycles": 5}
    one, team = parallel_env(**kwargs), FormationGymEnv(**kwargs)
    batch, slots = FormationVectorEnv(2, **kwargs), FormationVecEnv(2, **kwargs)
    slots.seed(8)
    for seed in (8, None):
        cars = np.stack(list(one.reset(seed=seed)[0].values()))
        assert bits(cars.ravel()) == bits(team.reset(seed=seed)[0])
        assert bits(cars.ravel()) == bits(batch.reset(seed=seed)[0][0])
        assert bits(cars) == bits(slots.reset()[:3])
    assert bits(batch.np_random.random()) == bits(np.random.default_rng(8).random())
    assert one.np_random is one._rng


@pytest.mark.parametrize("kwargs", [HARD, BUSY])
def test_threads_change_nothing(kwargs):
    runs = []
    for threads in (1, 2, 3):
        env = FormationVectorEnv(5, threads=threads, **kwargs)
        runs.append(bits(vector_run(env, 3, 65)[0]))
        env.close()
    assert runs[0] == runs[1] == runs[2]


def test_seeds_of_a_vector_can_be_given_one_by_one():
    env = FormationVectorEnv(3, max_cycles=10)
    first, _ = env.reset(seed=[7, 5, 7])
    assert bits(first[0]) == bits(first[2]) != bits(first[1])
    again, _ = env.reset(seed=7)
    assert bits(again[0]) == bits(first[0])


def test_a_vector_begins_those_anew_that_are_asked_for():
    env = FormationVectorEnv(3, **BUSY)
    vector_run(env, 3, 5)
    before = env.formation.observations.copy()
    after, _ = env.reset(options={"reset_mask": np.array([False, True, False])})
    after = after.reshape(before.shape)
    assert np.array_equal(after[[0, 2]], before[[0, 2]])
    assert not np.array_equal(after[1], before[1])
    assert env.formation.cycles.tolist() == [5, 0, 5]
