"""Engines that run jobs in parallel. A new engine needs a file and a line in `ENGINES`."""

from __future__ import annotations

from functools import partial

from agents.errors import UsageError
from agents.jobs.base import Engine
from agents.jobs.local import local
from agents.jobs.ray_engine import ray_engine

ENGINES: dict[str, Engine] = {"local": local, "ray": ray_engine}
"""Engine by name."""
JOINING = ("ray",)
"""Engines that can use a running cluster."""

MOST_JOBS = 1024


def find_engine(name: str, address: str | None = None) -> Engine:
    """Return an engine by its name.

    Args:
        name: One of `ENGINES`.
        address: Address of a running cluster, for the engines of `JOINING`.

    Raises:
        UsageError: No engine of that name, or an address for an engine without clusters.
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
    """Check and return the number of simultaneous calls.

    Raises:
        UsageError: The number is out of range.
    """
    if not 1 <= jobs <= MOST_JOBS:
        raise UsageError(f"--jobs: expected 1 to {MOST_JOBS}, got {jobs}")
    return jobs


__all__ = ["ENGINES", "JOINING", "Engine", "check_jobs", "find_engine"]
