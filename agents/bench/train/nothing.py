"""The peer of the environments: as many seats that see and want the same, and cost nothing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from stable_baselines3.common.vec_env import VecEnv

from relpos_env.interface.observations.base import F32
from tracking.arrays import Bool


class Nothing(VecEnv):  # type: ignore[misc]
    """Shows the same observations at every step; nothing ends."""

    def __init__(self, like: VecEnv, observations: F32) -> None:
        """Take the spaces and seats of an environment.

        Args:
            like: The environment.
            observations: Of one step of it, (seat, size), absent cars included.
        """
        self._observations = observations
        self._rewards = np.zeros(like.num_envs, np.float32)
        self._dones: Bool = np.zeros(like.num_envs, dtype=bool)
        self._infos: list[dict[str, Any]] = [{} for _ in range(like.num_envs)]
        self.render_mode = None
        super().__init__(like.num_envs, like.observation_space, like.action_space)

    def reset(self) -> F32:
        """The observations."""
        return self._observations

    def step_async(self, actions: F32) -> None:
        """Nothing."""

    def step_wait(self) -> tuple[F32, F32, Bool, list[dict[str, Any]]]:
        """The observations again; no rewards."""
        return self._observations, self._rewards.copy(), self._dones, self._infos

    def close(self) -> None:
        """Nothing."""

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Nothing to seed."""
        return [seed] * self.num_envs

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """An attribute, once for every seat asked for."""
        return [getattr(self, attr_name)] * len(list(self._get_indices(indices)))

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Set an attribute; the seats share it."""
        setattr(self, attr_name, value)

    def env_method(
        self, method_name: str, *method_args: Any, indices: Any = None, **method_kwargs: Any
    ) -> list[Any]:
        """Call a method once; its result for every seat asked for."""
        result = getattr(self, method_name)(*method_args, **method_kwargs)
        return [result] * len(list(self._get_indices(indices)))

    def env_is_wrapped(self, wrapper_class: type, indices: Any = None) -> list[bool]:
        """False for every seat."""
        return [False] * len(list(self._get_indices(indices)))
