"""Engine with a Ray cluster, started on this machine or already running.

A call whose worker or machine is lost is repeated, up to `MOST_TRIES` calls; errors raised by the
function are not retried. Results are equal to those of the local engine, bit for bit, even if
workers are lost.
"""

from __future__ import annotations

import logging
import os
import socket
import sys
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

from agents.errors import UsageError
from agents.jobs.base import Result

MOST_TRIES = 4
"""[-] Largest number of calls of one task whose workers are lost."""
STORE = 128 * 1024**2
"""[B] Shared memory of a cluster started here. Results below 100 kB, as most of ours are, do not
use it; larger data spills to disk."""

ANSWER = 10.0
"""[s] Timeout of a connection to a cluster."""


def ray_engine(
    function: Callable[..., Result],
    tasks: Sequence[tuple[Any, ...]],
    jobs: int,
    *,
    address: str | None = None,
) -> Iterator[tuple[int, Result]]:
    """Call a function with the arguments of every task; see `agents.jobs.base.Engine`.

    At most `jobs` calls are submitted at a time, so that pending tasks use no memory in the
    cluster. Each call uses one core.

    Args:
        function: Function of a module that every worker can import.
        tasks: Positional arguments of each call.
        jobs: Number of simultaneous calls, at least 1.
        address: Address of a running cluster, as for `ray.init`: ``auto`` or ``host:port``. None
            starts one with `jobs` cores on this machine and ends it afterwards. A program that has
            called `ray.init` itself keeps its cluster.

    Raises:
        UsageError: Ray is missing, no cluster answers, or workers of a task were lost too often.
    """
    if not tasks:
        return
    jobs = min(jobs, len(tasks))
    with cluster(jobs, address) as ray:
        # Ray's own retries are off: after running out of memory, they are unlimited.
        call = ray.remote(num_cpus=1, max_retries=0)(_call)
        folder = os.getcwd()
        waiting = deque((n, 1) for n in range(len(tasks)))
        running: dict[Any, tuple[int, int]] = {}
        while waiting or running:
            while waiting and len(running) < jobs:
                n, times = waiting.popleft()
                running[call.remote(folder, function, tasks[n])] = n, times
            (ready,), _ = ray.wait(list(running), num_returns=1)
            n, times = running.pop(ready)
            try:
                result = ray.get(ready)
            except ray.exceptions.RayTaskError as error:
                if error.cause is None or isinstance(error.cause, ray.exceptions.RayError):
                    raise UsageError(
                        "--engine ray: a worker could not read its task; expected the same "
                        f"packages on every machine: {_last_line(error)}"
                    ) from error
                raise error.cause from None
            except ray.exceptions.RayError as error:
                if times == MOST_TRIES:
                    raise UsageError(
                        f"--engine ray: the workers of task {n} were lost {times} times, perhaps "
                        f"for want of memory; expected fewer than {jobs} --jobs, or more memory: "
                        f"{_first_line(error)}"
                    ) from error
                # Retried last, so that a failing task does not delay the others.
                waiting.append((n, times + 1))
                continue
            yield n, result


def _call(folder: str, function: Callable[..., Any], task: tuple[Any, ...]) -> Any:
    """Call the function in a worker, in the caller's working directory if it exists there."""
    if os.path.isdir(folder):
        os.chdir(folder)
    return function(*task)


@contextmanager
def cluster(cores: int, address: str | None) -> Iterator[Any]:
    """Yield the module `ray`, connected to a cluster, and disconnect at the end.

    Args:
        cores: Number of cores of a new cluster.
        address: Address of a running cluster; None starts one. A program that has called
            `ray.init` itself keeps its cluster.

    Raises:
        UsageError: Ray is not installed, or no cluster answers at the address.
    """
    ray = import_ray()
    if ray.is_initialized():
        yield ray
        return
    start_ray(cores, address)
    try:
        yield ray
    finally:
        ray.shutdown()


def start_ray(cores: int, address: str | None) -> None:
    """Start a cluster on this machine, or connect to one, without logs and usage reports.

    Args:
        cores: Number of cores of a new cluster.
        address: Address of a running cluster; None starts one.

    Raises:
        UsageError: Ray is not installed, or no cluster answers at the address.
    """
    ray = import_ray()
    quiet: dict[str, Any] = {"log_to_driver": False, "logging_level": logging.ERROR}
    if address is None:
        variables = {
            # Workers use the module search path of this process.
            "PYTHONPATH": _absolute(sys.path),
            "RAY_USAGE_STATS_ENABLED": "0",
        }
        with _inherited(variables):
            # "local", since the default would also connect to any cluster on this machine.
            ray.init(
                address="local",
                num_cpus=cores,
                num_gpus=0,
                include_dashboard=False,
                object_store_memory=STORE,
                **quiet,
            )
        return
    path = os.environ.get("PYTHONPATH")
    if path:
        variables = {"PYTHONPATH": _absolute(path.split(os.pathsep))}
        quiet["runtime_env"] = {"env_vars": variables}
    _see_that_it_answers(address)
    try:
        ray.init(address=address, **quiet)
    except (ConnectionError, TimeoutError, RuntimeError, ValueError, ImportError) as error:
        raise UsageError(
            f"--address: expected a Ray cluster at {address!r}: {_first_line(error)}"
        ) from error


def _see_that_it_answers(address: str) -> None:
    """Check that a process listens at ``host:port``, since Ray itself would wait for minutes.

    Raises:
        UsageError: The connection fails.
    """
    host, _, port = address.removeprefix("ray://").rpartition(":")
    if not host or not port.isdecimal():
        return
    try:
        socket.create_connection((host.strip("[]"), int(port)), ANSWER).close()
    except (OSError, OverflowError) as error:
        raise UsageError(f"--address: expected a Ray cluster at {address!r}: {error}") from error


@contextmanager
def _inherited(variables: Mapping[str, str]) -> Iterator[None]:
    """Set environment variables for processes started inside the context."""
    before = {name: os.environ.get(name) for name in variables}
    os.environ.update(variables)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _absolute(folders: Sequence[str]) -> str:
    """Return a search path of absolute folders."""
    return os.pathsep.join(map(os.path.abspath, folders))


def import_ray() -> Any:
    """Return the module `ray`.

    Raises:
        UsageError: Ray is not installed.
    """
    try:
        import ray
        import ray.exceptions
    except ImportError as error:
        text = "--engine ray: needs ray: pip install -e '.[ray]' in its source folder"
        raise UsageError(text) from error
    return ray


def _last_line(error: Exception) -> str:
    return str(error).strip().splitlines()[-1]


def _first_line(error: Exception) -> str:
    return (str(error).strip().splitlines() or [type(error).__name__])[0]
