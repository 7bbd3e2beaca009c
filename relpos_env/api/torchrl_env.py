"""TorchRL environment over the compiled batch: an agent per car slot, a mask for absent cars."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from tensordict import TensorDict, TensorDictBase
from torchrl.data import Bounded, Categorical, Composite, Unbounded
from torchrl.envs import EnvBase

from relpos_env.api.state_space import state_space, truth_inside
from relpos_env.config import configure, whole_number
from relpos_env.core.env_core import MOST_ENVS, EnvCore
from relpos_env.errors import EnvError
from relpos_env.interface.observations import space_of
from relpos_env.interface.observations.base import F32
from relpos_env.interface.seeding import episode_rng, seeds_of_batch

AGENTS = "agents"
"""Key of the agent group."""


class FormationTorchEnv(EnvBase):  # type: ignore[misc]
    """``num_envs`` environments with ``batch_size=[num_envs]``; the cars are the group ``agents``.

    Keys, with their shapes after (env)::

        agents/observation    (car, size), zeros for absent cars; the last one in the step in which
                              a car leaves for good
        agents/mask           (car), True for cars that participate; the others have no effect
        agents/action         (car, 2) in [-1, 1], or (car) for discrete actions
        agents/reward         (car, 1), zeros for absent cars
        agents/done, terminated, truncated    (car, 1): over for this car, which leaves for good in
                              this step, or for its environment
        done, terminated, truncated           (1): the episode of the environment is over
        state                 (8 car), true state for critics, see `state_space`

    With the seed s environment k equals the other forms with the seed s + k. `reset` takes masks,
    as collectors of TorchRL pass them for environments that are done.
    """

    batch_locked = True

    def __init__(self, num_envs: int = 1, *, threads: int = 1, **arguments: Any) -> None:
        """Build the environments.

        Args:
            num_envs: Number of environments.
            threads: Number of parts of the batch that are stepped at a time.
            arguments: Fields of `relpos_env.config.FormationConfig`.

        Raises:
            EnvError: An unknown name or a number out of range; the argument is named.
        """
        n = whole_number("num_envs", num_envs, 1, MOST_ENVS)
        self._parts = configure(arguments)
        self.formation = EnvCore(self._parts, n, threads)
        self._truth_space = state_space(self._parts)
        self._seeds: list[int | None] = [None] * n
        self._are_seeded = np.zeros(n, dtype=bool)
        super().__init__(device=torch.device("cpu"), batch_size=torch.Size([n]))
        self._make_specs()

    @property
    def n_cars(self) -> int:
        """Number of car slots of an environment."""
        return self._parts.n_cars

    @property
    def max_episode_steps(self) -> int:
        """Steps until truncation."""
        return self._parts.config.max_cycles

    def close(self, *, raise_if_closed: bool = True) -> None:
        """Release threads."""
        self.formation.close()
        super().close(raise_if_closed=raise_if_closed)

    def _make_specs(self) -> None:
        group = (*self.batch_size, self.n_cars)
        observed = space_of(self._parts.mode.fields, self._parts.config.history)
        flags = {name: Categorical(2, (*group, 1), dtype=torch.bool) for name in _DONE}
        over = {name: Categorical(2, (*self.batch_size, 1), dtype=torch.bool) for name in _DONE}
        self.observation_spec = Composite(
            {
                AGENTS: Composite(
                    {
                        "observation": _bounded(observed, group),
                        "mask": Categorical(2, group, dtype=torch.bool),
                    },
                    shape=group,
                ),
                "state": _bounded(self._truth_space, self.batch_size),
            },
            shape=self.batch_size,
        )
        self.action_spec = Composite(
            {
                AGENTS: Composite(
                    {"action": _action_spec(self._parts.actions.space(), group)}, shape=group
                )
            },
            shape=self.batch_size,
        )
        self.reward_spec = Composite(
            {AGENTS: Composite({"reward": Unbounded((*group, 1))}, shape=group)},
            shape=self.batch_size,
        )
        self.done_spec = Composite(
            {AGENTS: Composite(flags, shape=group), **over}, shape=self.batch_size
        )

    def _reset(self, tensordict: TensorDictBase | None = None, **_: Any) -> TensorDictBase:
        which = np.arange(self.formation.n_envs)
        for key in ("_reset", (AGENTS, "_reset")):
            asked = None if tensordict is None else tensordict.get(key, None)
            if asked is not None:
                which = np.flatnonzero(asked.numpy().reshape(self.formation.n_envs, -1).any(axis=1))
                break
        for env in which.tolist():
            if self._seeds[env] is not None or not self._are_seeded[env]:
                self.formation.seed(env, episode_rng(self._seeds[env]))
                self._seeds[env], self._are_seeded[env] = None, True
        self.formation.begin(which.tolist())
        return self._observe(self._done(), self.formation.team_observations())

    def _step(self, tensordict: TensorDictBase) -> TensorDictBase:
        if not self._are_seeded.all():
            raise EnvError("the environment must be reset first")
        actions = tensordict[AGENTS, "action"].detach().numpy()
        self.formation.step(*self._parts.actions.decode(actions, "actions"))
        # With the last observations of cars that leave, from which estimators bootstrap.
        found = self._observe(self._done(), self.formation.observations.copy())
        rewards = torch.from_numpy(self.formation.rewards.astype(np.float32))
        found[AGENTS, "reward"] = rewards.unsqueeze(-1)
        return found

    def _set_seed(self, seed: int | None) -> None:
        self._seeds = seeds_of_batch(seed, self.formation.n_envs)

    def _observe(self, done: TensorDict, observations: F32) -> TensorDict:
        """Return observations, masks and the true state, added to the flags."""
        f = self.formation
        rows = observations.reshape(f.n_envs, self.n_cars, -1)
        done[AGENTS, "observation"] = torch.from_numpy(rows)
        done[AGENTS, "mask"] = torch.from_numpy(f.active.copy())
        done["state"] = torch.from_numpy(truth_inside(f.state, self._truth_space))
        return done

    def _done(self) -> TensorDict:
        """Return the flags of environments and of cars."""
        f, group = self.formation, (*self.batch_size, self.n_cars)
        ends = {"terminated": f.terminated, "truncated": f.truncated}
        ends["done"] = f.terminated | f.truncated
        cars = {name: np.repeat(flag[:, None], self.n_cars, axis=1) for name, flag in ends.items()}
        for name in ("truncated", "done"):  # a car that leaves could have driven on
            cars[name] = cars[name] | f.left
        done = TensorDict(
            {name: torch.from_numpy(v[:, None].copy()) for name, v in ends.items()}, self.batch_size
        )
        flags = {name: torch.from_numpy(v[..., None]) for name, v in cars.items()}
        done[AGENTS] = TensorDict(flags, group)
        return done


_DONE = ("done", "terminated", "truncated")


def _bounded(space: spaces.Box, batch: tuple[int, ...]) -> Bounded:
    shape = (*batch, *space.shape)
    low, high = (
        torch.from_numpy(np.broadcast_to(v, shape).copy()) for v in (space.low, space.high)
    )
    return Bounded(low=low, high=high, shape=shape, dtype=torch.float32)


def _action_spec(space: spaces.Space[Any], group: tuple[int, ...]) -> Bounded | Categorical:
    if isinstance(space, spaces.Discrete):
        return Categorical(int(space.n), shape=group, dtype=torch.int64)
    assert isinstance(space, spaces.Box)
    return _bounded(space, group)
