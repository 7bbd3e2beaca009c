"""Pacing of steps by a clock, and their lateness."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

NS = 1_000_000_000
GIVEN_UP = NS
"""[ns] Longest delay that is caught up; longer ones, as after sleep mode, shift the schedule."""


@dataclass(slots=True)
class Lateness:
    """Statistics of late steps."""

    steps: int = 0
    late: int = 0
    """[-] Steps that began more than one step length after their deadline."""
    worst_ns: int = 0
    """[ns] Largest delay."""


class Pace:
    """Absolute deadlines: a late step does not delay those after it."""

    def __init__(
        self, step_ns: int, clock: Callable[[], int], sleep: Callable[[float], None]
    ) -> None:
        """Set the deadline of the first step to the current time.

        Args:
            step_ns: Period of deadlines [ns].
            clock: Monotonic clock [ns].
            sleep: Sleeps for a number of seconds.
        """
        self._step_ns, self._clock, self._sleep = step_ns, clock, sleep
        self._due = clock()
        self.lateness = Lateness()

    def wait(self) -> int:
        """Wait for the next deadline; return the time of the clock [ns]."""
        now = self._clock()
        while now < self._due:
            self._sleep((self._due - now) / NS)
            now = self._clock()
        behind = now - self._due
        self.lateness.steps += 1
        self.lateness.late += behind > self._step_ns
        self.lateness.worst_ns = max(self.lateness.worst_ns, behind)
        self._due = now if behind > GIVEN_UP else self._due
        self._due += self._step_ns
        return now
