"""A time of a reading on the clock that a format writes."""

from __future__ import annotations

from fractions import Fraction
from itertools import groupby

from hardware_bridge.readings import DeviceClock, Reading


def ticks_on(clock: DeviceClock, reading: Reading) -> int:
    """When it was measured, in whole ticks of `clock`; 0 where it does not say."""
    said = reading.source
    if said.ticks is None or said.clock is None:
        return 0
    ticks = round(said.ticks * Fraction(clock.hz) / Fraction(said.clock.hz))
    return ticks % clock.modulus


def moments(readings: list[Reading]) -> list[list[Reading]]:
    """Readings that follow each other and were made at the same time, together."""
    return [list(same) for _, same in groupby(readings, key=lambda r: r.source.ticks)]
