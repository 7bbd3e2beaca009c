"""Alternating timed turns, so that other load on the machine affects all jobs equally."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import inf


def best_of_turns(jobs: Sequence[Callable[[], float]], turns: int) -> list[float]:
    """Run all jobs alternately; return the smallest value of each.

    Args:
        jobs: Functions that return the time of one turn, in any unit.
        turns: Number of turns.
    """
    best = [inf] * len(jobs)
    for _ in range(turns):
        for k, job in enumerate(jobs):
            best[k] = min(best[k], job())
    return best
