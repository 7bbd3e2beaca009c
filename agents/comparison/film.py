"""Animation of the median episode of every row, which is repeated for it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from agents.comparison.episode import film_episode
from agents.comparison.result import CompareResult
from agents.jobs import find_engine


def median_films(
    result: CompareResult,
    *,
    jobs: int = 1,
    engine: str = "local",
    address: str | None = None,
    progress: Callable[[float], None] | None = None,
) -> list[dict[str, Any]]:
    """Return the animation frames by row, identical to the measured episodes.

    Args:
        result: Result of the comparison.
        jobs: Parallel processes.
        engine: One of `agents.jobs.ENGINES`.
        address: Address of a running cluster, see `agents.jobs.find_engine`.
        progress: Called with the completed share, 0 to 1.
    """
    tasks = [(r.contender, r.setting, r.median_episode.seed) for r in result.rows]
    films: dict[int, dict[str, Any]] = {}
    for n, frames in find_engine(engine, address)(film_episode, tasks, jobs):
        films[n] = frames
        if progress is not None:
            progress(len(films) / len(tasks))
    return [films[n] for n in range(len(tasks))]
