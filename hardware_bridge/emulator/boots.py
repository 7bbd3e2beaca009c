"""Boot numbers of an emulated device: they rise from start to start, as a key asks of firmware."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np

FIRST = 1 << 31
"""The first is drawn below this: what is above is left for starts to come."""


def boot_numbers(rng: np.random.Generator) -> Iterator[int]:
    """One number a start: the first is drawn, each later one is the next, as of a counter in flash.

    Args:
        rng: Gives the first, at once.
    """
    return itertools.count(int(rng.integers(1, FIRST)))
