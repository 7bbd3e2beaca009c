"""Ctrl-C, and signals that mean the same, where the work can be left and nowhere else."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType, TracebackType


class Interrupts:
    """Holds KeyboardInterrupt back but for places that allow it.

    It takes over SIGINT and SIGTERM where these would raise KeyboardInterrupt; who ignores them, or
    dies of them, goes on doing so. Only the main thread hears signals: in others it does nothing.

    Laws: nothing is raised outside `allowed`; what came before is raised by the next `allowed`, and
    what is raised by none is served by the end of the work.
    """

    def __init__(self) -> None:
        self._taken: list[signal.Signals] = []
        self._came = self._allowed = False

    def __enter__(self) -> Interrupts:
        if threading.current_thread() is threading.main_thread():
            for number in (signal.SIGINT, signal.SIGTERM):
                if signal.getsignal(number) is signal.default_int_handler:
                    signal.signal(number, self._take)
                    self._taken.append(number)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        for number in self._taken:
            signal.signal(number, signal.default_int_handler)
        self._taken.clear()

    @contextmanager
    def allowed(self) -> Iterator[None]:
        """Here the work can be left.

        Raises:
            KeyboardInterrupt: A signal comes, or came since the last such place.
        """
        self._allowed = True
        try:
            if self._came:
                self._came = False
                raise KeyboardInterrupt
            yield
        finally:
            self._allowed = False

    def _take(self, number: int, frame: FrameType | None) -> None:
        if not self._allowed:
            self._came = True
            return
        # One is enough: what follows it has to be done in peace.
        self._allowed = False
        raise KeyboardInterrupt
