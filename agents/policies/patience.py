"""Time limit of network runs, since a small file can request any amount of work."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol

LOOK_EVERY = 0.1
"""[s] Interval of the checks."""


class Run(Protocol):
    """Part of onnxruntime's `RunOptions`; the flag is checked between two operators."""

    terminate: bool


class Patience:
    """Time limit of runs in one process, checked by a thread that starts with the first run."""

    def __init__(self, seconds: float) -> None:
        """Set the time limit.

        Args:
            seconds: Time limit of a run [s].
        """
        self.seconds = seconds
        self._runs: dict[int, tuple[float, Run]] = {}
        """Deadline and run, by thread."""
        self._watched_by = 0
        """Process of the watching thread: a forked process has no threads of its parent."""

    @contextmanager
    def over(self, run: Run) -> Iterator[None]:
        """Terminate the run at the time limit."""
        if self._watched_by != os.getpid():
            self._watched_by, self._runs = os.getpid(), {}
            threading.Thread(target=self._watch, name="patience", daemon=True).start()
        me = threading.get_ident()
        self._runs[me] = time.monotonic() + self.seconds, run
        try:
            yield
        finally:
            del self._runs[me]

    def _watch(self) -> None:
        while True:
            time.sleep(LOOK_EVERY)
            now = time.monotonic()
            for due, run in list(self._runs.values()):
                if now > due:
                    run.terminate = True
