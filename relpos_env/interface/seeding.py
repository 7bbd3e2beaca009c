"""The one rule by which a seed leads to episodes.

The episodes of an environment come one after the other from ``episode_rng(seed)``. In a batch,
environment k has the seed ``seed + k``. So the same seed gives the same episodes in every form.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from gymnasium.utils import seeding

from relpos_env.errors import EnvError


def episode_rng(seed: int | None) -> np.random.Generator:
    """The generator of all episodes of an environment; None is a seed by chance.

    Raises:
        EnvError: The seed is no whole number of at least 0.
    """
    if seed is not None:
        is_number = isinstance(seed, int | np.integer) and not isinstance(seed, bool)
        if not is_number or seed < 0:
            raise EnvError(f"seed: expected a whole number of at least 0, got {seed!r}")
        seed = int(seed)
    return seeding.np_random(seed)[0]


def seeds_of_batch(seed: int | Sequence[int | None] | None, n_envs: int) -> list[int | None]:
    """The seed of each environment of a batch.

    Args:
        seed: Of the first environment, the others count on; or one for each.
        n_envs: How many there are.

    Raises:
        EnvError: Not as many seeds as environments.
    """
    if seed is None:
        return [None] * n_envs
    if isinstance(seed, int | np.integer):
        return [int(seed) + k for k in range(n_envs)]
    if len(seed) != n_envs:
        raise EnvError(f"seed: expected {n_envs} seeds, got {len(seed)}")
    return list(seed)
