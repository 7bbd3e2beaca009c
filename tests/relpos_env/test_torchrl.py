"""TorchRL: its checker, masks, resets of some environments, the same episodes as other forms."""

import numpy as np
import pytest
from runs import bits, busy

pytest.importorskip("torch")
pytest.importorskip("torchrl")

import torch
from tensordict.nn import TensorDictModule
from torchrl.envs.utils import check_env_specs

from relpos_env.api.sb3_vec_env import FormationVecEnv
from relpos_env.api.torchrl_env import FormationTorchEnv
from relpos_env.errors import EnvError
from relpos_env.interface.observations import OBSERVATIONS
from relpos_env.tasks import TASKS

BUSY = {"scenario": busy(), "max_cycles": 40}


def rows(tensor, n):
    """Return the values of all slots, (slot, ...)."""
    return tensor.numpy().reshape(n, *tensor.shape[2:])


@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize("actions", ["continuous", "discrete"])
def test_the_checker_passes_on_every_task(task, actions):
    env = FormationTorchEnv(2, task=task, actions=actions, max_cycles=6)
    env.set_seed(1)
    check_env_specs(env)
    env.close()


@pytest.mark.parametrize("observation", OBSERVATIONS)
def test_the_checker_passes_on_every_observation(observation):
    check_env_specs(FormationTorchEnv(2, observation=observation, history=2, max_cycles=6))


def test_the_checker_passes_while_cars_come_and_go():
    check_env_specs(FormationTorchEnv(3, threads=2, **BUSY))


@pytest.mark.parametrize(
    "kwargs",
    [BUSY, {"max_cycles": 15, "actions": "discrete"}, {"trackers": "own", "max_cycles": 9}],
)
def test_it_has_the_episodes_of_the_stable_baselines_form(kwargs):
    twin, env = FormationVecEnv(2, **kwargs), FormationTorchEnv(2, **kwargs)
    twin.seed(30)
    env.set_seed(30)
    seen, found, rng, n = twin.reset(), env.reset(), np.random.default_rng(7), 2 * env.n_cars
    n_left = 0
    for _ in range(100):
        seated = twin.active  # a car that has just left still has its last observation
        assert bits(rows(found["agents", "observation"], n)[seated]) == bits(seen[seated])
        assert bits(rows(found["agents", "mask"], n)) == bits(twin.active)
        actions = rng.integers(15, size=n) if "actions" in kwargs else rng.uniform(-1, 1, (n, 2))
        actions = actions if "actions" in kwargs else actions.astype(np.float32)
        shape = (2, env.n_cars, *actions.shape[1:])
        found["agents", "action"] = torch.from_numpy(actions.reshape(shape))
        seen, rewards, dones, infos = twin.step(actions)
        over, found = env.step_and_maybe_reset(found)
        assert bits(rows(over["next", "agents", "reward"], n)[:, 0]) == bits(rewards)
        assert bits(rows(over["next", "agents", "done"], n)[:, 0]) == bits(dones)
        last = rows(over["next", "agents", "observation"], n)
        for row in np.flatnonzero(dones):
            assert bits(last[row]) == bits(infos[row]["terminal_observation"])
        of_car = over["next", "agents", "done"].all(dim=1)
        assert torch.equal(of_car, over["next", "done"]) or not of_car.any()
        n_left += int((over["next", "agents", "done"] & ~over["next", "done"][:, None]).sum())
    assert (n_left > 0) == (kwargs is BUSY)


def test_only_environments_in_the_mask_are_reset():
    env = FormationTorchEnv(3, max_cycles=50)
    env.set_seed(4)
    before = env.rollout(10)[:, -1]["next"].clone()
    before["_reset"] = torch.tensor([[False], [True], [False]])
    after = env.reset(before.clone())
    same = (after["agents", "observation"] == before["agents", "observation"]).flatten(1).all(dim=1)
    assert same.tolist() == [True, False, True]
    assert env.formation.cycles.tolist() == [10, 0, 10]


def test_a_mask_of_cars_resets_their_environments():
    env = FormationTorchEnv(3, max_cycles=50)
    mask = torch.zeros(3, env.n_cars, 1, dtype=torch.bool)
    mask[1, 0] = True
    before = env.rollout(5)[:, -1]["next"].clone()
    before["agents", "_reset"] = mask
    env._reset(before)
    assert env.formation.cycles.tolist() == [5, 0, 5]


def test_a_network_drives_while_gradients_are_recorded():
    env = FormationTorchEnv(2, max_cycles=8)
    size = env.observation_spec["agents", "observation"].shape[-1]
    keys = [("agents", "observation")], [("agents", "action")]
    policy = TensorDictModule(torch.nn.Linear(size, 2), *keys)
    assert env.rollout(4, policy=policy)["agents", "action"].requires_grad


def test_a_step_before_the_first_reset_is_refused():
    env = FormationTorchEnv(2)
    with pytest.raises(EnvError, match="must be reset first"):
        env._step(env.rand_action())


def test_same_seed_same_rollout():
    def rollout(seed):
        env = FormationTorchEnv(2, max_cycles=12)
        env.set_seed(seed)
        torch.manual_seed(0)
        return env.rollout(30, break_when_any_done=False)["next", "agents", "observation"]

    first, again, other = (rollout(seed) for seed in (3, 3, 4))
    assert torch.equal(first, again)
    assert not torch.equal(first, other)


@pytest.mark.parametrize(
    ("num_envs", "kwargs", "message"),
    [(0, {}, "num_envs: expected"), (2, {"task": "fly"}, "task: expected"),
     (2, {"threads": 3}, "threads: expected")],
)  # fmt: skip
def test_wrong_arguments_are_named(num_envs, kwargs, message):
    with pytest.raises(EnvError, match=message):
        FormationTorchEnv(num_envs, **kwargs)
