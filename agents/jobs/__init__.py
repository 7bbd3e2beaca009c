"""Where work is done that can be shared out. Adding an engine: a file and a line."""

from __future__ import annotations

from functools import partial

from agents.errors import UsageError
from agents.jobs.base import Engine
from agents.jobs.local import local
from agents.jobs.ray_engine import ray_engine

ENGINES: dict[str, Engine] = {"local": local, "ray": ray_engine}
"""Name to engine."""
JOINING = ("ray",)
"""Engines that take the address of a cluster."""

MOST_JOBS = 1024


def find_engine(name: str, address: str | None = None) -> Engine:
    """Look an engine up.

    Args:
        name: One of `ENGINES`.
        address: Of a cluster that runs, for the engines of `JOINING`.

    Raises:
        UsageError: None of that name, or an address that it has no use for.
    """
    if name not in ENGINES:
        raise UsageError(f"--engine: expected one of {', '.join(ENGINES)}, got {name!r}")
    if address is None:
        return ENGINES[name]
    if name not in JOINING:
        raise UsageError(f"--address: expected --engine {' or '.join(JOINING)} with it")
    joined: Engine = partial(ENGINES[name], address=address)  # type: ignore[call-arg]
    return joined


def check_jobs(jobs: int) -> int:
    """A number of calls at a time.

    Raises:
        UsageError: Out of range.
    """
    if not 1 <= jobs <= MOST_JOBS:
        raise UsageError(f"--jobs: expected 1 to {MOST_JOBS}, got {jobs}")
    return jobs


__all__ = ["ENGINES", "JOINING", "Engine", "check_jobs", "find_engine"]
