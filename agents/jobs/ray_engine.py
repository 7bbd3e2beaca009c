"""Work shared out over a Ray cluster: one that is started for it on this machine, or one that runs.

A call whose worker or machine is lost is made again, until it was made `MOST_TRIES` times; an
error that the function itself raises is not. So results are those of the local engine, bit for
bit, whatever happens to the workers.
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
"""[-] Calls of one task until its workers have been lost too often."""
STORE = 128 * 1024**2
"""[B] Shared memory of a cluster that is started here. Results of less than 100 kB, as most of ours
are, do not go through it, and what does not fit goes to the disk."""

ANSWER = 10.0
"""[s] Within which a cluster answers."""


def ray_engine(
    function: Callable[..., Result],
    tasks: Sequence[tuple[Any, ...]],
    jobs: int,
    *,
    address: str | None = None,
) -> Iterator[tuple[int, Result]]:
    """Call a function with the arguments of every task; see `agents.jobs.base.Engine`.

    At most `jobs` calls are under way at a time, so what waits takes no memory in the cluster.
    Each takes one core.

    Args:
        function: Of a module, which every worker can import.
        tasks: Positional arguments of each call.
        jobs: Calls at a time, at least 1.
        address: Of a running cluster, as for `ray.init`: ``auto`` or ``host:port``. None starts
            one with `jobs` cores on this machine and ends it afterwards. A program that has
            called `ray.init` itself keeps the cluster it has.

    Raises:
        UsageError: No ray, no cluster at the address, or workers of a task were lost too often.
    """
    if not tasks:
        return
    jobs = min(jobs, len(tasks))
    with cluster(jobs, address) as ray:
        # Ray's own retries are off: those after a want of memory have no bound.
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
                # Last, so that what makes workers fail does not hold up the rest.
                waiting.append((n, times + 1))
                continue
            yield n, result


def _call(folder: str, function: Callable[..., Any], task: tuple[Any, ...]) -> Any:
    """The call itself, in a worker; names of files mean there what they mean here."""
    if os.path.isdir(folder):
        os.chdir(folder)
    return function(*task)


@contextmanager
def cluster(cores: int, address: str | None) -> Iterator[Any]:
    """The module `ray`, joined to a cluster; what was started here ends here.

    Args:
        cores: Of a cluster that is started.
        address: Of a cluster that runs; None starts one. Where the program has called `ray.init`
            itself, it keeps the cluster it has.

    Raises:
        UsageError: No ray, or no cluster at the address.
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
    """Start a cluster on this machine, or join one; it is quiet, and sends no reports.

    Args:
        cores: Of a cluster that is started.
        address: Of a cluster that runs; None starts one.

    Raises:
        UsageError: No ray, or no cluster at the address.
    """
    ray = import_ray()
    quiet: dict[str, Any] = {"log_to_driver": False, "logging_level": logging.ERROR}
    if address is None:
        variables = {
            # Workers find modules where this process does.
            "PYTHONPATH": _absolute(sys.path),
            "RAY_USAGE_STATS_ENABLED": "0",
        }
        with _inherited(variables):
            # "local", since nothing would also join whatever cluster happens to run here.
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
    """A process listens at ``host:port``; Ray itself would wait for minutes.

    Raises:
        UsageError: None does.
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
    """Variables of the environment that processes started meanwhile see."""
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
    """A search path that means the same in any folder."""
    return os.pathsep.join(map(os.path.abspath, folders))


def import_ray() -> Any:
    """The module `ray`.

    Raises:
        UsageError: It is not installed.
    """
    try:
        import ray
        import ray.exceptions
    except ImportError as error:
        raise UsageError("--engine ray: needs ray: pip install 'relpos-env[ray]'") from error
    return ray


def _last_line(error: Exception) -> str:
    return str(error).strip().splitlines()[-1]


def _first_line(error: Exception) -> str:
    return (str(error).strip().splitlines() or [type(error).__name__])[0]
