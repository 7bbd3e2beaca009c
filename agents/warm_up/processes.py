"""Parts compiled side by side, each in a process of its own.

Kernels are kept on disk once they are compiled, so a process that compiles some of them saves all
later ones the time.
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
"""[s] Time between two looks at the processes."""
Progress = Callable[[float, str], None]
"""Takes the share done and what is being done."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WarmUp:
    """What was done."""

    parts: tuple[str, ...]
    compiled: tuple[str, ...]
    """Those of them that had to be compiled."""
    seconds: float
    largest_mb: float
    """[MB] Memory of the largest process; 0 if none was needed, or where it is not known."""

    @property
    def summary(self) -> dict[str, Any]:
        """As a line of JSON."""
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
        parts: Of `parts_of`; those of one name count once.
        later: Parts that are begun once a process is free and none of the others is left.
        jobs: Processes, by default as many as there are cores.
        progress: Called several times a second until `parts` are done, if any is compiled.
        finished: Called with the name of each part that has been compiled.
        is_stopped: Asked several times a second whether to give up.

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
    """`warm_up` for a command: with a bar, or lines where there is no terminal, if it takes time.

    Args:
        filters: Those that do not come with the package are compiled when they run.
        purpose: One of `agents.warm_up.parts.PURPOSES`.
        in_space: Whether groups move in space, too, or in a plane only.
    """
    names = tuple(name for name in dict.fromkeys(filters) if name in FILTERS)
    with shown_progress() as tell:
        warm_up(parts_of(purpose, names, in_space=in_space), progress=tell)


@contextmanager
def shown_progress() -> Iterator[Progress]:
    """A bar on a terminal, lines elsewhere; nothing until progress is reported."""
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
    """Parts that the disk does not have, those that take long first."""
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
    """Compile parts in processes, one after the other."""
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
                # How long it takes is a guess: the bar slows down, it does not stand at its end.
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
    """[MB] Largest memory of a process that this one has waited for."""
    try:
        import resource
    except ImportError:  # not there on Windows
        return 0.0
    largest = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
    return float(largest) / (1e6 if sys.platform == "darwin" else 1e3)
