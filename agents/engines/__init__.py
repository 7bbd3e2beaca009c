"""Where work is done that can be shared out. Adding an engine: a file and a line."""

from __future__ import annotations

from agents.engines.base import Engine
from agents.engines.local import local
from agents.errors import UsageError

ENGINES: dict[str, Engine] = {"local": local}
"""Name to engine."""

MOST_JOBS = 1024


def find_engine(name: str) -> Engine:
    """Look an engine up.

    Raises:
        UsageError: None of that name.
    """
    if name not in ENGINES:
        raise UsageError(f"--engine: expected one of {', '.join(ENGINES)}, got {name!r}")
    return ENGINES[name]


def check_jobs(jobs: int) -> int:
    """A number of calls at a time.

    Raises:
        UsageError: Out of range.
    """
    if not 1 <= jobs <= MOST_JOBS:
        raise UsageError(f"--jobs: expected 1 to {MOST_JOBS}, got {jobs}")
    return jobs


__all__ = ["ENGINES", "Engine", "check_jobs", "find_engine"]
