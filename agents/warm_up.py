"""Compiling a tracker ahead, in as many processes as there are cores: what `relpos warmup` does.

Kernels are kept on disk once they are compiled, so a process that compiles some of them saves all
later ones the time. Each process compiles one group of kernels at a time (`Tracker.calls`).
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any

from agents.console import progress_bar
from agents.errors import UsageError
from tracking import Constellation, NodeConfig, Tracker
from tracking.filters import FILTERS, filter_builder
from tracking.jit import Call, bind, is_compiled

SECONDS = {"joint": (35.0, 25.0, 20.0, 6.0)}
"""[s] Time of each group of a filter on one core of a laptop, for the progress that is shown."""
OTHERS = 8.0
"""[s] Time of a group that is not in the table."""
PERIOD = 0.1
"""[s] Time between two looks at the processes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WarmUp:
    """What was done."""

    filter: str
    n_kernels: int
    """Kernels that the filter calls."""
    n_compiled: int
    """Those of them that had to be compiled."""
    seconds: float

    @property
    def summary(self) -> dict[str, Any]:
        """As a line of JSON."""
        return {
            "filter": self.filter,
            "kernels": self.n_kernels,
            "compiled": self.n_compiled,
            "seconds": round(self.seconds, 2),
        }


def warm_up(
    name: str = "joint",
    *,
    everything: bool = True,
    jobs: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> WarmUp:
    """Compile what a filter needs, unless it is on the disk.

    Args:
        name: One of `tracking.filters.FILTERS`, or ``package.module:Name``.
        everything: Also what is needed now and then only; else that is compiled when it is.
        jobs: Processes, by default as many as there are cores.
        progress: Called with the share done, several times a second, if anything is compiled.

    Raises:
        ConfigError: No filter of that name.
        UsageError: A process failed.
    """
    began = time.monotonic()
    groups = calls_of(name)
    wanted = [k for k in range(len(groups)) if everything or k in (0, 1, len(groups) - 1)]
    missing = [
        k for k in wanted if not all(is_compiled(kernel, *given) for kernel, given in groups[k])
    ]
    seconds = [*SECONDS.get(name, ()), *[OTHERS] * len(groups)]
    missing.sort(key=lambda k: -seconds[k])
    _run(name, missing, seconds, jobs or os.cpu_count() or 1, progress)
    return WarmUp(
        filter=name,
        n_kernels=sum(len(groups[k]) for k in wanted),
        n_compiled=sum(len(groups[k]) for k in missing),
        seconds=time.monotonic() - began,
    )


def warm_up_first(names: Sequence[str], *, everything: bool = True) -> None:
    """`warm_up` for a command: with a bar, or a line where there is no terminal, if it takes time.

    Args:
        names: Filters; those that do not come with the package are compiled when they run.
        everything: As of `warm_up`.
    """
    for name in dict.fromkeys(names):
        if name in FILTERS:
            _warm_up_shown(name, everything)


def _warm_up_shown(name: str, everything: bool) -> None:
    label, bars = f"compiling {name}, once", list[Callable[[float], None]]()
    with ExitStack() as stack:

        def tell(share: float) -> None:
            if not bars:
                if not sys.stderr.isatty():
                    print(f"{label}: a minute or less", file=sys.stderr, flush=True)
                bars.append(stack.enter_context(progress_bar(label)))
            bars[0](share)

        warm_up(name, everything=everything, progress=tell)


def calls_of(name: str) -> list[list[Call]]:
    """Kernels of a tracker with a filter, in groups; the same for all groups of nodes."""
    nodes = tuple(NodeConfig(id=k) for k in range(3))
    filter_builder(name)
    return Tracker(Constellation(nodes=nodes, dimensions=2), filter=name).calls()


def _run(
    name: str,
    missing: Sequence[int],
    seconds: Sequence[float],
    jobs: int,
    progress: Callable[[float], None] | None,
) -> None:
    """Compile groups in processes, the longest first."""
    waiting, running, began = list(missing), dict[int, "subprocess.Popen[str]"](), time.monotonic()
    jobs = max(min(jobs, len(waiting)), 1)
    times = [seconds[k] for k in waiting]
    expected = max(sum(times) / jobs, *times, PERIOD)
    try:
        while waiting or running:
            while waiting and len(running) < jobs:
                k = waiting.pop(0)
                running[k] = subprocess.Popen(
                    _run_command(name, k), stderr=subprocess.PIPE, text=True
                )
            time.sleep(PERIOD)
            for k, process in list(running.items()):
                if process.poll() is not None:
                    del running[k]
                    _, said = process.communicate()
                    if process.returncode:
                        last = said.strip().splitlines()[-1:] or ["without a word"]
                        raise UsageError(f"compiling {name} failed: {last[0]}")
            if progress is not None:
                # What is left is not known; the bar slows down instead of standing at its end.
                passed = (time.monotonic() - began) / expected
                progress(passed / (0.3 + passed) if passed > 0.7 else passed)
    finally:
        for process in running.values():
            process.kill()
            process.wait()


def _run_command(name: str, k: int) -> list[str]:
    return [sys.executable, "-m", "agents.warm_up", name, str(k)]


def _compile(name: str, k: int) -> None:
    """Compile one group in this process."""
    for kernel, given in calls_of(name)[k]:
        bind(kernel, *given)


if __name__ == "__main__":
    _compile(sys.argv[1], int(sys.argv[2]))
