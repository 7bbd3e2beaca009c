"""Times of samples with a constant rate and without stamps.

Arrival times alone are inaccurate: a hub that forwards samples in bunches, or a message that
blocked the line, causes gaps without a lost sample, and filling such gaps integrates a rotation
twice. Samples are taken one period apart, so a late one is mapped to its due time. Only if all
samples of a while are late by at least most of a period, samples were lost.
"""

from __future__ import annotations

WHILE = 20
"""[-] Number of late samples in a row after which losses are assessed."""
MOST = 0.06
"""[s] Later samples are not moved back: the trackers wait no longer than their horizon."""
SURE = 0.75
"""[-] Lateness of all samples, as a fraction of a period, that counts as a lost sample."""
STEP = 0.4
"""[-] Largest step, as a fraction of a period, for a device slower than its nominal rate."""


class EvenTime:
    """Times of one node's samples; a `StreamTime`.

    Invariants: times are never after the arrival, and never before that of the previous sample;
    without losses consecutive times are at most 1.4 periods apart if no sample is later than
    `MOST`; over any long time as much time passes as at the host.
    """

    def __init__(self, rate: float) -> None:
        """Create a mapping without samples.

        Args:
            rate: Nominal sample rate as configured [1/s].
        """
        self._period = round(1e9 / rate)
        self._last: int | None = None
        self._n, self._least = 0, 0

    def map(self, ticks: int | None, arrival_ns: int) -> int:
        """Return the host time of a sample [ns]; see `StreamTime.map`."""
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
        """Handle a restart of the device."""
        self._last, self._n = None, 0
