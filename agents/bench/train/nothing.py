"""Peer of the environments with the same agent slots and spaces, and no cost per step."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from relpos_env.api.sb3_attributes import SharedAttributeVecEnv
from relpos_env.interface.observations.base import F32
from tracking.arrays import Bool


class Nothing(SharedAttributeVecEnv):
    """Environment that returns the same observations at every step and never ends."""

    def __init__(self, like: SharedAttributeVecEnv, observations: F32) -> None:
        """Copy spaces and agent slots of an environment.

        Args:
            like: Environment to imitate.
            observations: Observations of one step, (slot, size), absent cars included.
        """
        self._observations = observations
        self._rewards = np.zeros(like.num_envs, np.float32)
        self._dones: Bool = np.zeros(like.num_envs, dtype=bool)
        self._infos: list[dict[str, Any]] = [{} for _ in range(like.num_envs)]
        self.render_mode = None
        super().__init__(like.num_envs, like.observation_space, like.action_space)

    def reset(self) -> F32:
        """Return the observations."""
        return self._observations

    def step_async(self, actions: F32) -> None:
        """Ignore the actions."""

    def step_wait(self) -> tuple[F32, F32, Bool, list[dict[str, Any]]]:
        """Return the same observations with zero rewards."""
        return self._observations, self._rewards.copy(), self._dones, self._infos

    def close(self) -> None:
        """Do nothing."""

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Return the seed for every slot; nothing is random."""
        return [seed] * self.num_envs
