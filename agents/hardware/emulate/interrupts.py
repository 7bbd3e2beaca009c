"""Deferral of Ctrl-C and SIGTERM to points where the work can be interrupted."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType, TracebackType


class Interrupts:
    """Context that defers KeyboardInterrupt to blocks that allow it.

    Replaces the handlers of SIGINT and SIGTERM that raise KeyboardInterrupt; other handlers stay.
    Signals are handled in the main thread only; in other threads this context has no effect.

    Properties: nothing is raised outside `allowed`; an earlier signal is raised by the next
    `allowed`, and dropped if the work ends without one.
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
        """Allow KeyboardInterrupt inside the context.

        Raises:
            KeyboardInterrupt: A signal arrives, or arrived since the last such context.
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
        # The cleanup after the first interrupt must not be interrupted again.
        self._allowed = False
        raise KeyboardInterrupt
