"""Runs of networks that take too long are ended: a small file can ask for any amount of work."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol

LOOK_EVERY = 0.1
"""[s]"""


class Run(Protocol):
    """What onnxruntime's `RunOptions` has for it: looked at between two operators."""

    terminate: bool


class Patience:
    """Of one process. A thread, begun with the first run, looks at the run that lasts."""

    def __init__(self, seconds: float) -> None:
        """Set the time.

        Args:
            seconds: That a run may take [s].
        """
        self.seconds = seconds
        self._runs: dict[int, tuple[float, Run]] = {}
        """By thread: when it has to be over, and the run to end."""
        self._watched_by = 0
        """Process that has the thread: a fork has none of its parent's."""

    @contextmanager
    def over(self, run: Run) -> Iterator[None]:
        """End the run if it lasts too long."""
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
