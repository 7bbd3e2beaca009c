"""Tasks that need the tracker: rewards for certain estimates, and a car that drives by itself."""

import numpy as np
import pytest

from relpos_env import formation_v0
from relpos_env.errors import EnvError
from relpos_env.tasks import make_task

STILL = np.zeros(2, np.float32)


def steps(env, n, seed=0, action=lambda agent: STILL):
    env.reset(seed=seed)
    for _ in range(n):
        yield env.step({agent: action(agent) for agent in env.agents})


def test_information_is_that_of_the_own_estimates():
    env = formation_v0.parallel_env(task="observe", scenario="open", n_cars=3, max_cycles=100)
    informed, curve = 0, np.array([0.4, 0.5], np.float32)
    for *_, infos in steps(env, 100, action=lambda agent: curve):
        view = env.formation.loop.view
        for k, info in enumerate(infos.values()):
            others = [j for j in range(3) if j != k]
            terms = [
                np.exp(-np.sqrt(view.cov[0, k, j, :2].sum()) / 0.1) * view.ok[0, k, j]
                for j in others
            ]
            assert info["reward_information"] == pytest.approx(np.mean(terms))
            informed += info["reward_information"] > 0.0
    assert informed > 0


def test_any_task_can_have_it():
    env = formation_v0.parallel_env(task="observe", scenario="open", reward="information")
    *_, infos = list(steps(env, 5))[-1]
    for info in infos.values():
        assert info["reward_own"] == info["reward_information"]
    env = formation_v0.parallel_env(task="hold", reward="information")
    *_, infos = list(steps(env, 5))[-1]
    assert all(0.0 <= info["reward_own"] <= 1.0 for info in infos.values())


def test_information_is_not_that_of_the_truth():
    """Policies that observe the truth are rewarded for the estimates all the same."""
    rewards = []
    for observation in ("estimate", "truth"):
        env = formation_v0.parallel_env(task="observe", observation=observation, max_cycles=30)
        infos = [infos for *_, infos in steps(env, 30)]
        rewards.append([[i["reward_information"] for i in info.values()] for info in infos])
    np.testing.assert_array_equal(*rewards)


def test_the_escorted_car_drives_by_itself():
    paths = []
    for value in (0.0, 1.0):
        env = formation_v0.parallel_env(task="escort", n_cars=2, max_cycles=100)
        action = {"car_0": np.full(2, value, np.float32), "car_1": STILL}
        for _ in steps(env, 100, seed=3, action=action.get):
            pass
        paths.append(env.formation.state.pos_w[0, 0].copy())
    np.testing.assert_array_equal(*paths)
    assert np.linalg.norm(paths[0]) > 1.0


def test_it_drives_otherwise_in_each_episode_and_alike_for_a_seed():
    def end(seed):
        env = formation_v0.parallel_env(task="escort", n_cars=2, max_cycles=80)
        for _ in steps(env, 80, seed=seed):
            pass
        return env.formation.state.pos_w[0, 0].tolist()

    assert end(5) == end(5)
    assert end(5) != end(6)


def test_nothing_tells_where_it_drives_but_estimates():
    env = formation_v0.parallel_env(task="escort", n_cars=3, max_cycles=60)
    for _ in steps(env, 60):
        assert not env.formation.operator.command.any()
        assert not env.formation.task.plan.any()


@pytest.mark.parametrize("n_cars", [2, 3, 6, 12])
def test_slots_are_round_the_escorted_car_and_apart(n_cars):
    task = make_task("escort", n_cars, 1, (20.0, 20.0))
    pos = np.random.default_rng(0).uniform(-2.0, 2.0, (n_cars, 2))
    task.begin(0, pos, np.arange(n_cars))
    slots = task._places[0]
    gaps = np.linalg.norm(slots[:, None] - slots[None], axis=-1)[~np.eye(n_cars, dtype=bool)]
    assert not slots[0].any()
    assert gaps.min() > 0.99


@pytest.mark.parametrize("options", [{"spacing": 9.0}, {"spacing": 0.1}, {"speed": 0.0}])
def test_options_out_of_range_are_named(options):
    with pytest.raises(EnvError, match=f"^{next(iter(options))}: expected"):
        make_task("escort", 6, 1, (8.0, 8.0), **options)
