"""Parallel compilation of parts, each in a separate process.

Compiled kernels stay on disk, so later processes load them instead of compiling them.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from agents.cli.console import progress_bar
from agents.errors import UsageError
from agents.warm_up.parts import Part, parts_of
from tracking.filters import FILTERS

PERIOD = 0.1
"""[s] Polling period of the processes."""
Progress = Callable[[float, str], None]
"""Callback with the share done, 0 to 1, and the current work."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WarmUp:
    """Result of a compilation."""

    parts: tuple[str, ...]
    compiled: tuple[str, ...]
    """Names of the parts that had to be compiled."""
    seconds: float
    largest_mb: float
    """[MB] Memory of the largest process; 0 if none was needed or it is unknown."""

    @property
    def summary(self) -> dict[str, Any]:
        """JSON record."""
        return {
            "parts": list(self.parts),
            "compiled": list(self.compiled),
            "seconds": round(self.seconds, 2),
            "largest_mb": round(self.largest_mb, 1),
        }


def warm_up(
    parts: Iterable[Part],
    *,
    later: Iterable[Part] = (),
    jobs: int | None = None,
    progress: Progress | None = None,
    finished: Callable[[str], None] = lambda name: None,
    is_stopped: Callable[[], bool] = lambda: False,
) -> WarmUp:
    """Compile parts, unless they are on the disk.

    Args:
        parts: Parts of `parts_of`; parts with the same name are compiled once.
        later: Parts that are started when a process is free and all of `parts` are started.
        jobs: Number of processes; by default one per core.
        progress: Called several times a second until `parts` are done, if any is compiled.
        finished: Called with the name of each compiled part.
        is_stopped: Polled several times a second; stops the compilation by returning True.

    Raises:
        UsageError: A process failed.
    """
    began, named = time.monotonic(), {part.name: part for part in parts}
    missing = _missing(named.values())
    others = _missing({p.name: p for p in later if p.name not in named}.values())
    if missing or others:
        _run(missing, others, jobs or os.cpu_count() or 1, progress, finished, is_stopped)
    return WarmUp(
        parts=tuple(named),
        compiled=tuple(part.name for part in (*missing, *others)),
        seconds=time.monotonic() - began,
        largest_mb=_largest_child() if missing else 0.0,
    )


def warm_up_first(
    filters: Iterable[str],
    *,
    purpose: str = "track",
    in_space: bool = True,
) -> None:
    """Compile the parts of a command, with a progress bar or, without a terminal, lines.

    Args:
        filters: Filters; those outside of the package are compiled when they run.
        purpose: One of `agents.warm_up.parts.PURPOSES`.
        in_space: Whether groups may be three-dimensional; False covers two dimensions only.
    """
    names = tuple(name for name in dict.fromkeys(filters) if name in FILTERS)
    with shown_progress() as tell:
        warm_up(parts_of(purpose, names, in_space=in_space), progress=tell)


@contextmanager
def shown_progress() -> Iterator[Progress]:
    """Yield a function that shows progress as a bar on a terminal, or else as lines on stderr."""
    bars: list[Callable[[float], None]] = []
    said: list[str] = []
    label = "compiling, once"

    def tell(share: float, what: str) -> None:
        if not sys.stderr.isatty():
            if said[-1:] != [what]:
                said.append(what)
                print(f"{label}: {100 * share:3.0f} %, {what}", file=sys.stderr, flush=True)
            return
        if not bars:
            bars.append(bar.__enter__())
        bars[0](share)

    bar = progress_bar(label)
    try:
        yield tell
    finally:
        if bars:
            bar.__exit__(None, None, None)


def _missing(parts: Iterable[Part]) -> list[Part]:
    """Return the parts that are not on disk, longest first, dependent ones last."""
    missing = [part for part in parts if not part.is_kept()]
    return sorted(missing, key=lambda part: (part.needs_others, -part.seconds))


def _run(
    missing: Sequence[Part],
    others: Sequence[Part],
    jobs: int,
    progress: Progress | None,
    finished: Callable[[str], None],
    is_stopped: Callable[[], bool],
) -> None:
    """Start the compilation of parts in this order, at most `jobs` at a time."""
    began, waiting = time.monotonic(), [*missing, *others]
    left = {part.name for part in missing}
    running: dict[str, subprocess.Popen[str]] = {}
    times = [part.seconds for part in missing or others]
    expected = max(sum(times) / min(jobs, len(times)), *times)
    try:
        while (waiting or running) and not is_stopped():
            while waiting and len(running) < jobs and not (waiting[0].needs_others and running):
                part = waiting.pop(0)
                running[part.name] = subprocess.Popen(
                    _command(part.name),
                    stdout=subprocess.DEVNULL,
                    stderr=subprocess.PIPE,
                    text=True,
                )
            time.sleep(PERIOD)
            for name, process in list(running.items()):
                if process.poll() is not None:
                    del running[name]
                    _, said = process.communicate()
                    if process.returncode:
                        last = said.strip().splitlines()[-1:] or ["without a word"]
                        raise UsageError(f"compiling {name} failed: {last[0]}")
                    left.discard(name)
                    finished(name)
            if progress is not None and left:
                # The expected time is a guess: the bar slows down instead of stopping at 100 %.
                passed = (time.monotonic() - began) / expected
                share = passed if passed < 0.7 else passed / (0.3 + passed)
                what = ", ".join(name for name in running if name in left)
                if what:
                    progress(share, f"{len(left)} of {len(missing)} parts left: {what}")
    finally:
        for process in running.values():
            process.kill()
            process.communicate()


def _command(name: str) -> list[str]:
    return [sys.executable, "-m", "agents.warm_up", name]


def _largest_child() -> float:
    """Return the largest peak memory of a terminated child process [MB]."""
    try:
        import resource
    except ImportError:  # not available on Windows
        return 0.0
    largest = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
    return float(largest) / (1e6 if sys.platform == "darwin" else 1e3)
