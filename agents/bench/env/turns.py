"""Taking turns, so that whatever else the machine does hits all alike."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import inf


def best_of_turns(jobs: Sequence[Callable[[], float]], turns: int) -> list[float]:
    """The least that each job returns, over turns in which all take part one after the other.

    Args:
        jobs: Each returns the time of one turn [us per env-step].
        turns: How many.
    """
    best = [inf] * len(jobs)
    for _ in range(turns):
        for k, job in enumerate(jobs):
            best[k] = min(best[k], job())
    return best
