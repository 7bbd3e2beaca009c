"""Compilation in the background of a running command."""

from __future__ import annotations

import threading
from collections.abc import Iterable
from typing import Self

from agents.warm_up.parts import Part
from agents.warm_up.processes import PERIOD, Progress, warm_up


class BackgroundWarmUp:
    """Context that compiles parts in separate processes, and ends these on exit.

    Args:
        needed: Parts that are compiled first; `wait_for_needed` waits for them.
        later: Parts that are compiled as soon as a process is free.
    """

    def __init__(self, needed: Iterable[Part], later: Iterable[Part]) -> None:
        self._needed = [part for part in needed if not part.is_kept()]
        self._left = {part.name for part in self._needed}
        self._later = [part for part in later if not part.is_kept()]
        self._stop, self._error = threading.Event(), list[BaseException]()
        self._said = 0.0, ""
        self._thread = threading.Thread(target=self._compile, name="warm-up", daemon=True)
        self.missing = tuple(part.name for part in self._later)
        """Names of the parts of `later` that were not on the disk."""

    def __enter__(self) -> Self:
        if self._needed or self._later:
            self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._stop.set()
        if self._thread.ident is not None:
            self._thread.join()

    def is_done(self) -> bool:
        """Return whether the compilation has ended."""
        return not self._thread.is_alive()

    def wait_for_needed(self, progress: Progress) -> None:
        """Wait until the needed parts are compiled.

        Args:
            progress: Called several times a second during the wait.

        Raises:
            UsageError: A process failed.
        """
        while self._left and not self.is_done():
            self._thread.join(PERIOD)
            if self._said[1]:
                progress(*self._said)
        self._raise_error()

    def wait(self) -> None:
        """Wait until all parts are compiled.

        Raises:
            UsageError: A process failed.
        """
        if self._thread.ident is not None:
            self._thread.join()
        self._raise_error()

    def _raise_error(self) -> None:
        if self._error:
            raise self._error[0]

    def _compile(self) -> None:
        try:
            warm_up(
                self._needed,
                later=self._later,
                progress=self._say,
                finished=self._left.discard,
                is_stopped=self._stop.is_set,
            )
        except BaseException as error:  # raised in the waiting thread
            self._error.append(error)

    def _say(self, share: float, what: str) -> None:
        self._said = share, what
