"""Conversion of the time of a reading to the clock of a format."""

from __future__ import annotations

from fractions import Fraction
from itertools import groupby

from hardware_bridge.readings import DeviceClock, Reading


def ticks_on(clock: DeviceClock, reading: Reading) -> int:
    """Return the time of measurement in whole ticks of `clock`; 0 without a time."""
    said = reading.source
    if said.ticks is None or said.clock is None:
        return 0
    ticks = round(said.ticks * Fraction(clock.hz) / Fraction(said.clock.hz))
    return ticks % clock.modulus


def moments(readings: list[Reading]) -> list[list[Reading]]:
    """Group consecutive readings of the same time."""
    return [list(same) for _, same in groupby(readings, key=lambda r: r.source.ticks)]
