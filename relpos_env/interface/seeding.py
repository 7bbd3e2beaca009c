"""Seeding of episodes, common to all environment classes.

The episodes of an environment are sampled in sequence from ``episode_rng(seed)``. In a batch,
environment k has the seed ``seed + k``. The same seed gives the same episodes in every class.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from gymnasium.utils import seeding

from relpos_env.errors import EnvError


def episode_rng(seed: int | None) -> np.random.Generator:
    """Return the generator of all episodes of an environment; None is a random seed.

    Raises:
        EnvError: The seed is not an integer of at least 0.
    """
    if seed is not None:
        is_number = isinstance(seed, int | np.integer) and not isinstance(seed, bool)
        if not is_number or seed < 0:
            raise EnvError(f"seed: expected a whole number of at least 0, got {seed!r}")
        seed = int(seed)
    return seeding.np_random(seed)[0]


def seeds_of_batch(seed: int | Sequence[int | None] | None, n_envs: int) -> list[int | None]:
    """Return the seed of each environment of a batch.

    Args:
        seed: Seed of the first environment, incremented for the others; or one for each.
        n_envs: Number of environments.

    Raises:
        EnvError: A seed is not an integer of at least 0, or their number is not that of the
            environments.
    """
    if seed is None:
        return [None] * n_envs
    if isinstance(seed, str) or not isinstance(seed, Sequence | np.ndarray):
        episode_rng(seed)
        return [int(seed) + k for k in range(n_envs)]
    if len(seed) != n_envs:
        raise EnvError(f"seed: expected {n_envs} seeds, got {len(seed)}")
    for one in seed:
        episode_rng(one)
    return [None if one is None else int(one) for one in seed]
