"""Timing of batches in separate processes that step at the same time."""

from __future__ import annotations

import multiprocessing
import time
from multiprocessing.connection import Connection
from typing import Any

from agents.bench.env.batch import Batch
from agents.bench.env.drives import followed

PATIENCE = 1800.0
"""[s] Longest wait for a process, including the compilation of kernels at its start."""


def processes_cost(n_envs: int, processes: int, *, resets: int, warm_up: int, turns: int) -> float:
    """Return the time per env-step of all processes [us]: the slowest process in the best turn.

    Args:
        n_envs: Environments of each process.
        processes: Number of processes.
        resets: Resets per turn of each process.
        warm_up: Steps before the first turn.
        turns: Number of turns.

    Raises:
        RuntimeError: A process ended or did not answer.
    """
    context = multiprocessing.get_context("spawn")
    ends, workers = [], []
    for _ in range(processes):
        ours, theirs = context.Pipe()
        arguments = (theirs, n_envs, resets, warm_up)
        workers.append(context.Process(target=_serve, args=arguments, daemon=True))
        ends.append(ours)
    try:
        for worker in workers:
            worker.start()
        for end in ends:
            _receive(end)
        best = min(_together(ends) for _ in range(turns))
        for end in ends:
            end.send("stop")
    finally:
        for worker in workers:
            worker.join(5.0)
            if worker.is_alive():
                worker.terminate()
    return best / processes


def _together(ends: list[Connection]) -> float:
    """Run a turn in all processes; return the largest time [us per env-step of one process]."""
    for end in ends:
        end.send("turn")
    return max(float(_receive(end)) for end in ends)


def _receive(end: Connection) -> Any:
    try:
        if end.poll(PATIENCE):
            return end.recv()
    except EOFError:
        pass
    raise RuntimeError("bench: a process of its own ended or did not answer")


def _serve(end: Connection, n_envs: int, resets: int, warm_up: int) -> None:
    """Run turns on request in a worker; times include actions, so that all are always busy."""
    batch = Batch(n_envs, followed, resets=resets)
    batch.warm_up(warm_up)
    end.send("ready")
    while end.recv() == "turn":
        began = time.perf_counter()
        batch.turn()
        end.send(1e6 * (time.perf_counter() - began) / (batch.steps * n_envs))
    batch.close()
