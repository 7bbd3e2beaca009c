"""Steps at their times by a clock, or as fast as they go."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

NS = 1_000_000_000
GIVEN_UP = NS
"""[ns] A delay beyond this, such as of a machine that slept, is not made up for."""


@dataclass(slots=True)
class Lateness:
    """How well the steps kept to their times."""

    steps: int = 0
    late: int = 0
    """Steps that began more than a step's length after their time."""
    worst_ns: int = 0
    """The latest."""


class Pace:
    """Absolute deadlines: a late step does not delay those after it."""

    def __init__(
        self, step_ns: int, clock: Callable[[], int], sleep: Callable[[float], None]
    ) -> None:
        """Begin with the first step due now.

        Args:
            step_ns: From deadline to deadline.
            clock: Monotonic [ns].
            sleep: Waits for so many seconds.
        """
        self._step_ns, self._clock, self._sleep = step_ns, clock, sleep
        self._due = clock()
        self.lateness = Lateness()

    def wait(self) -> int:
        """Wait for the next deadline; what the clock says then."""
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
