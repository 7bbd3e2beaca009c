"""Engine with processes of this machine."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from typing import Any

from agents.errors import UsageError
from agents.jobs.base import Result
from agents.jobs.child import follow_parent


def local(
    function: Callable[..., Result], tasks: Sequence[tuple[Any, ...]], jobs: int
) -> Iterator[tuple[int, Result]]:
    """Call a function with the arguments of every task; see `agents.jobs.base.Engine`.

    A single job runs in this process. For more jobs, the calling script must be importable, with
    its work below `if __name__ == "__main__"`.
    """
    jobs = min(jobs, len(tasks))
    if jobs <= 1:
        for n, task in enumerate(tasks):
            yield n, function(*task)
        return
    # Spawned processes, since a forked one would share the threads of compiled libraries.
    spawn = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(jobs, mp_context=spawn, initializer=follow_parent)
    try:
        waiting = {pool.submit(function, *task): n for n, task in enumerate(tasks)}
        for future in as_completed(waiting):
            yield waiting.pop(future), future.result()
    except BrokenProcessPool as error:
        raise UsageError(
            "--jobs: a process was ended from outside, perhaps for want of memory; "
            f"expected fewer than {jobs}"
        ) from error
    finally:
        pool.shutdown(cancel_futures=True)
