"""Experience of all seats, of which only that of cars in the room is learned from."""

from __future__ import annotations

from collections.abc import Generator

import numpy as np
from stable_baselines3.common.buffers import RolloutBuffer
from stable_baselines3.common.type_aliases import RolloutBufferSamples


class SwarmRolloutBuffer(RolloutBuffer):  # type: ignore[misc]
    """A rollout buffer that leaves the seats of absent cars out; these see nothing but zeros."""

    generator_ready: bool

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
