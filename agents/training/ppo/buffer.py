"""Experience of all seats, of which only that of cars in the room is learned from."""

from __future__ import annotations

from collections.abc import Generator

import numpy as np
import torch
from stable_baselines3.common.buffers import RolloutBuffer
from stable_baselines3.common.type_aliases import RolloutBufferSamples


class SwarmRolloutBuffer(RolloutBuffer):  # type: ignore[misc]
    """A rollout buffer that leaves the seats of absent cars out; these see nothing but zeros."""

    generator_ready: bool

    def compute_returns_and_advantage(
        self, last_values: torch.Tensor, dones: np.ndarray[tuple[int], np.dtype[np.bool_]]
    ) -> None:
        """Generalised advantages; what comes after a car has gone says nothing about its action.

        The value of an absent car's zeros is not learned, so nothing may rest on it: the step
        after which a car is gone, for a while or for good, has no advantage, and no other looks
        beyond it.

        Args:
            last_values: Of the observations after the last step, (seat, 1).
            dones: Whether episodes ended with it, (seat).
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
        """Random batches of one size, all there is at most once; a smaller rest is left out.

        Args:
            batch_size: None for all at once.
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
