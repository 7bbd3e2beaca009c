"""Parallel runs, each in its own process.

Networks of this size train only 1.4 times as fast with two threads, and the result depends
strongly on the seed. Cores are therefore better used for runs with different seeds, of which the
best is kept.
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
"""Callback with the index of the run, its completed share and the record of an interval."""


def train_side_by_side(
    configs: Sequence[TrainConfig], folders: Sequence[Path], progress: Progress
) -> list[TrainResult]:
    """Train policies, or resume their runs.

    The calling script must be importable: put its code below `if __name__ == "__main__"`.

    Args:
        configs: Configurations of the runs; ignored for runs that are resumed.
        folders: Folders of the runs; a run in a folder is resumed.
        progress: See `Progress`.

    Raises:
        UsageError: A run failed or its process was killed; the others are stopped and keep their
            last checkpoints.
        EnvError: An environment is invalid.
    """
    # Spawned, because a forked process would share the threads of compiled libraries.
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
                    message = connection.recv()
                except EOFError as error:
                    raise UsageError(
                        f"{folders[k]}: its process was ended from outside, perhaps for want of "
                        "memory; go on with --resume, or begin with fewer --runs"
                    ) from error
                if isinstance(message, Exception):
                    raise message
                if isinstance(message, TrainResult):
                    results[k] = message
                    del waiting[connection]
                else:
                    progress(k, *message)
    finally:
        for process in processes:
            process.terminate()
            process.join()
    return [results[k] for k in range(len(configs))]


def _run(connection: Connection, config: TrainConfig, folder: Path) -> None:
    """Train one run in its process; send every interval, then the result or the error."""
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
        # Other exceptions may not be picklable; the traceback is printed here.
        traceback.print_exc()
        connection.send(UsageError(f"{folder}: {type(error).__name__}: {error}"))
    else:
        connection.send(result)
