"""The peer of the environments: as many seats that see and want the same, and cost nothing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from relpos_env.api.sb3_attributes import SharedAttributeVecEnv
from relpos_env.interface.observations.base import F32
from tracking.arrays import Bool


class Nothing(SharedAttributeVecEnv):
    """Shows the same observations at every step; nothing ends."""

    def __init__(self, like: SharedAttributeVecEnv, observations: F32) -> None:
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
