"""Rollout buffer of all agent slots; only slots of present cars are trained on."""

from __future__ import annotations

from collections.abc import Generator

import numpy as np
import torch
from stable_baselines3.common.buffers import RolloutBuffer
from stable_baselines3.common.type_aliases import RolloutBufferSamples


class SwarmRolloutBuffer(RolloutBuffer):  # type: ignore[misc]
    """A rollout buffer that omits slots of absent cars, whose observations are all zeros."""

    generator_ready: bool

    def compute_returns_and_advantage(
        self, last_values: torch.Tensor, dones: np.ndarray[tuple[int], np.dtype[np.bool_]]
    ) -> None:
        """Compute generalised advantages without bootstrapping from observations of absent cars.

        The value of an absent car's zeros is not trained. The last step before a car is absent,
        temporarily or finally, therefore has zero advantage, and earlier advantages are summed up
        to that step only.

        Args:
            last_values: Values of the observations after the last step, (slot, 1).
            dones: True where the episode ended with the last step, (slot,).
        """
        after = last_values.clone().cpu().numpy().flatten()
        goes_on = 1.0 - dones.astype(np.float32)
        present = self.observations.any(axis=2)
        stays = np.ones(present.shape, dtype=np.float32)
        stays[:-1] = present[1:]
        advantage = np.zeros_like(after)
        for step in range(self.buffer_size - 1, -1, -1):
            delta = self.rewards[step] + self.gamma * after * goes_on - self.values[step]
            trace = self.gamma * self.gae_lambda * goes_on * advantage
            advantage = stays[step] * (delta + trace)
            self.advantages[step] = advantage
            after, goes_on = self.values[step], 1.0 - self.episode_starts[step]
        self.returns = self.advantages + self.values

    def get(self, batch_size: int | None = None) -> Generator[RolloutBufferSamples, None, None]:
        """Yield random batches of equal size, each transition at most once; drop the remainder.

        Args:
            batch_size: Transitions per batch; None for all in one batch.
        """
        if not self.generator_ready:
            for name in (
                "observations", "actions", "values", "log_probs", "advantages", "returns",
            ):  # fmt: skip
                setattr(self, name, self.swap_and_flatten(getattr(self, name)))
            self.generator_ready = True
        present = np.flatnonzero(self.observations.any(axis=1))
        # Stable-Baselines3 seeds numpy's global generator, which is part of a run's seed.
        order = present[np.random.permutation(len(present))]  # noqa: NPY002
        size = min(batch_size or len(order), len(order))
        for first in range(0, len(order) - size + 1, size):
            yield self._get_samples(order[first : first + size])
