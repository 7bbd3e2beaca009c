"""Several runs at the same time, each in a process of its own.

A run uses one core well and two less so: networks this small are learned 1.4 times as fast by two
threads. How good a policy gets depends much on the seed. So the cores are better spent on runs of
different seeds, of which the best is kept.
"""

from __future__ import annotations

import multiprocessing
import traceback
from collections.abc import Callable, Sequence
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any

from agents.errors import UsageError
from agents.jobs.child import follow_parent
from agents.training.config import TrainConfig
from agents.training.run_folder import RunFolder
from agents.training.train import TrainResult, train
from relpos_env.errors import EnvError

Progress = Callable[[int, float, dict[str, Any] | None], None]
"""Called after every leg with the number of the run, its share done and what was measured."""


def train_side_by_side(
    configs: Sequence[TrainConfig], folders: Sequence[Path], progress: Progress
) -> list[TrainResult]:
    """Train policies, or go on with their runs.

    The calling script must be importable: its work belongs below `if __name__ == "__main__"`.

    Args:
        configs: Of the runs; none that has begun already is changed.
        folders: Of the runs; those with a run in them go on.
        progress: See `Progress`.

    Raises:
        UsageError: A run failed or was ended from outside; the others are stopped at their last
            checkpoints.
        EnvError: An environment that cannot be.
    """
    # New processes, since a forked one would share the threads of compiled libraries.
    spawn = multiprocessing.get_context("spawn")
    results: dict[int, TrainResult] = {}
    waiting: dict[Connection, int] = {}
    processes = []
    try:
        for k, (config, folder) in enumerate(zip(configs, folders, strict=True)):
            mine, theirs = spawn.Pipe(duplex=False)
            process = spawn.Process(target=_run, args=(theirs, config, folder), daemon=True)
            process.start()
            theirs.close()
            processes.append(process)
            waiting[mine] = k
        while waiting:
            for connection in wait(list(waiting)):
                assert isinstance(connection, Connection)
                k = waiting[connection]
                try:
                    told = connection.recv()
                except EOFError as error:
                    raise UsageError(
                        f"{folders[k]}: its process was ended from outside, perhaps for want of "
                        "memory; go on with --resume, or begin with fewer --runs"
                    ) from error
                if isinstance(told, Exception):
                    raise told
                if isinstance(told, TrainResult):
                    results[k] = told
                    del waiting[connection]
                else:
                    progress(k, *told)
    finally:
        for process in processes:
            process.terminate()
            process.join()
    return [results[k] for k in range(len(configs))]


def _run(connection: Connection, config: TrainConfig, folder: Path) -> None:
    """One run, in its process: tells every leg, then the result or what went wrong."""
    follow_parent()
    begun = RunFolder(folder).exists()
    try:
        result = train(
            None if begun else config,
            folder,
            progress=lambda share, row: connection.send((share, row)),
        )
    except (UsageError, EnvError) as error:
        connection.send(error)
    except Exception as error:
        # Whatever else it is may not be one that can be sent; where it began is told here.
        traceback.print_exc()
        connection.send(UsageError(f"{folder}: {type(error).__name__}: {error}"))
    else:
        connection.send(result)
