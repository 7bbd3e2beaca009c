"""Compiling a tracker ahead, in as many processes as there are cores: what `relpos warmup` does.

Kernels are kept on disk once they are compiled, so a process that compiles some of them saves all
later ones the time. Each process compiles one group of kernels at a time (`Tracker.calls`).
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Sequence
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
Group = tuple[str, int]
"""A filter, and which group of its kernels."""
PERIOD = 0.1
"""[s] Time between two looks at the processes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WarmUp:
    """What was done."""

    filters: tuple[str, ...]
    n_kernels: int
    """Kernels that they call."""
    n_compiled: int
    """Those of them that had to be compiled."""
    seconds: float

    @property
    def summary(self) -> dict[str, Any]:
        """As a line of JSON."""
        return {
            "filters": list(self.filters),
            "kernels": self.n_kernels,
            "compiled": self.n_compiled,
            "seconds": round(self.seconds, 2),
        }


def warm_up(
    names: Sequence[str],
    *,
    everything: bool = True,
    jobs: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> WarmUp:
    """Compile what filters need, unless it is on the disk.

    Args:
        names: Some of `tracking.filters.FILTERS`, or ``package.module:Name``.
        everything: Also what is needed now and then only; else that is compiled when it is.
        jobs: Processes, by default as many as there are cores.
        progress: Called with the share done, several times a second, if anything is compiled.

    Raises:
        ConfigError: No filter of that name.
        UsageError: A process failed.
    """
    began, names = time.monotonic(), tuple(dict.fromkeys(names))
    wanted: dict[Group, list[Call]] = {}
    known: set[int] = set()  # kernels that filters share have the same types in all of them
    for name in names:
        groups = calls_of(name)
        for k, group in enumerate(groups):
            is_rare = 1 < k < len(groups) - 1
            if (everything or not is_rare) and not known.issuperset(id(c) for c, _ in group):
                wanted[name, k] = group
                known.update(id(c) for c, _ in group)
    missing = [g for g, calls in wanted.items() if not all(is_compiled(k, *a) for k, a in calls)]
    missing.sort(key=_seconds, reverse=True)
    if missing:
        _run(missing, jobs or os.cpu_count() or 1, progress)
    return WarmUp(
        filters=names,
        n_kernels=sum(map(len, wanted.values())),
        n_compiled=sum(len(wanted[group]) for group in missing),
        seconds=time.monotonic() - began,
    )


def warm_up_first(names: Iterable[str], *, everything: bool = True) -> None:
    """`warm_up` for a command: with a bar, or a line where there is no terminal, if it takes time.

    Args:
        names: Filters; those that do not come with the package are compiled when they run.
        everything: As of `warm_up`.
    """
    names = [name for name in names if name in FILTERS]
    label, bars = "compiling the tracker, once", list[Callable[[float], None]]()
    with ExitStack() as stack:

        def tell(share: float) -> None:
            if not bars:
                if not sys.stderr.isatty():
                    print(f"{label}: about a minute", file=sys.stderr, flush=True)
                bars.append(stack.enter_context(progress_bar(label)))
            bars[0](share)

        if names:
            warm_up(names, everything=everything, progress=tell)


def calls_of(name: str) -> list[list[Call]]:
    """Kernels of a tracker with a filter, in groups; the same for all groups of nodes."""
    nodes = tuple(NodeConfig(id=k) for k in range(3))
    filter_builder(name)
    return Tracker(Constellation(nodes=nodes, dimensions=2), filter=name).calls()


def _seconds(group: Group) -> float:
    """How long a group takes, about."""
    name, k = group
    known = SECONDS.get(name, ())
    return known[k] if k < len(known) else OTHERS


def _run(missing: Sequence[Group], jobs: int, progress: Callable[[float], None] | None) -> None:
    """Compile groups in processes, one after the other."""
    began, waiting, running = time.monotonic(), list(missing), list["subprocess.Popen[str]"]()
    times = [_seconds(group) for group in missing]
    expected = max(sum(times) / min(jobs, len(missing)), *times)
    try:
        while waiting or running:
            while waiting and len(running) < jobs:
                command = _run_command(*waiting.pop(0))
                running.append(subprocess.Popen(command, stderr=subprocess.PIPE, text=True))
            time.sleep(PERIOD)
            for process in [p for p in running if p.poll() is not None]:
                running.remove(process)
                _, said = process.communicate()
                if process.returncode:
                    last = said.strip().splitlines()[-1:] or ["without a word"]
                    raise UsageError(f"compiling failed: {last[0]}")
            if progress is not None:
                # How long it takes is a guess: the bar slows down, it does not stand at its end.
                passed = (time.monotonic() - began) / expected
                progress(passed if passed < 0.7 else passed / (0.3 + passed))
    finally:
        for process in running:
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
