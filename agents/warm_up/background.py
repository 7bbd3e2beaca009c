"""Filters compiled while something else runs: what is shown last need not be waited for."""

from __future__ import annotations

import threading
from collections.abc import Iterable
from typing import Self

from agents.warm_up.parts import parts_of
from agents.warm_up.processes import warm_up


class BackgroundWarmUp:
    """Compiles trackers of groups in a plane in processes of their own from `__enter__` on.

    Ends them on `__exit__`.
    """

    def __init__(self, filters: Iterable[str]) -> None:
        self._parts = {name: parts_of("track", (name,), in_space=False) for name in filters}
        self._stop, self._error = threading.Event(), list[BaseException]()
        self._thread = threading.Thread(target=self._compile, name="warm-up", daemon=True)
        self.missing = tuple(
            name for name, parts in self._parts.items() if not all(part.is_kept() for part in parts)
        )
        """Filters whose code was not on the disk."""

    def __enter__(self) -> Self:
        if self.missing:
            self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._stop.set()
        if self.missing:
            self._thread.join()

    def is_done(self) -> bool:
        """Whether nothing is being compiled any more."""
        return not self._thread.is_alive()

    def wait(self) -> None:
        """Return once all is compiled.

        Raises:
            UsageError: A process failed.
        """
        if self.missing:
            self._thread.join()
        if self._error:
            raise self._error[0]

    def _compile(self) -> None:
        parts = [part for name in self.missing for part in self._parts[name]]
        try:
            warm_up(parts, is_stopped=self._stop.is_set)
        except BaseException as error:  # shown by those who wait
            self._error.append(error)
