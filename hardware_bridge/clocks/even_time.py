"""Times of samples that come at a steady rate and tell none.

Their arrival alone is a bad time: a hub that hands them on in bunches, or a message that held up
the line, makes gaps in which nothing was lost, and to fill such gaps integrates a turn twice.
The samples themselves were taken one period after the other; so a late one is put where it was due.
Only when all of a while come late by as much, samples were lost.
"""

from __future__ import annotations

WHILE = 20
"""[-] Samples after which it is judged whether some were lost."""
MOST = 0.06
"""[s] Later than this no sample is put back: the trackers wait no longer than their horizon."""
SURE = 0.75
"""[-] Of a period: all late by so much is one lost."""
STEP = 0.4
"""[-] Of a period: moved at once where a device is slower than it says, without a gap."""


class EvenTime:
    """The times of one node's samples; a `StreamTime`.

    Laws: never after the arrival, and never before the sample before; without losses no two are
    further apart than 1.4 periods, whatever arrives up to `MOST` late; over any long time as much
    passes as at the host.
    """

    def __init__(self, rate: float) -> None:
        """Begin without a sample.

        Args:
            rate: Of the samples, as the configuration has it [1/s].
        """
        self._period = round(1e9 / rate)
        self._last: int | None = None
        self._n, self._least = 0, 0

    def map(self, ticks: int | None, arrival_ns: int) -> int:
        """When a sample was taken, by the host [ns]; see `StreamTime.map`."""
        period = self._period
        due = arrival_ns if self._last is None else self._last + period
        late = arrival_ns - due
        if late <= 0 or late > MOST * 1e9:
            self._n = 0
            self._last = arrival_ns
            return arrival_ns
        self._least = late if self._n == 0 else min(self._least, late)
        self._n += 1
        if self._n >= WHILE:
            self._n = 0
            if self._least >= SURE * period:
                due += max(round(self._least / period), 1) * period
            else:
                due += min(self._least, round(STEP * period))
        self._last = min(due, arrival_ns)
        return self._last

    def restart(self) -> None:
        """The device started again."""
        self._last, self._n = None, 0
