"""Boot numbers of an emulated device, rising with every start, as required with a key."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np

FIRST = 1 << 31
"""Upper bound of the first number; higher ones remain for later starts."""


def boot_numbers(rng: np.random.Generator) -> Iterator[int]:
    """Return one number per start: the first is random, later ones count up, as a counter in flash.

    Args:
        rng: Generator of the first number, used at once.
    """
    return itertools.count(int(rng.integers(1, FIRST)))
