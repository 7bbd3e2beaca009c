"""The median episode of every row, driven once more and filmed."""

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
    """Frames for the animation, by row; the same drives as those that were measured.

    Args:
        result: Whose rows.
        jobs: Processes at a time.
        engine: One of `agents.jobs.ENGINES`.
        address: Of a cluster that runs, see `agents.jobs.find_engine`.
        progress: Called with the share done, 0 to 1.
    """
    tasks = [(r.contender, r.setting, r.median_episode.seed) for r in result.rows]
    films: dict[int, dict[str, Any]] = {}
    for n, frames in find_engine(engine, address)(film_episode, tasks, jobs):
        films[n] = frames
        if progress is not None:
            progress(len(films) / len(tasks))
    return [films[n] for n in range(len(tasks))]
