"""Time stamps of a UWB radio: integers of 40 bits that wrap every 17.2 s.

One tick is 1 / (128 x 499.2 MHz), 15.65 ps or 4.69 mm of flight; a transmission can be ordered
for a multiple of 512 ticks, 8.01 ns (DW1000 User Manual, sections 3.3 and 4.1.6). All arithmetic
here is on integers: rounding occurs only when a difference becomes a distance.
"""

from __future__ import annotations

TICK_HZ = 128 * 499.2e6
"""[Hz] Ticks per second of a perfect clock."""
SPEED_OF_LIGHT = 299_792_458.0
"""[m/s] Speed of light in vacuum."""
METRES_PER_TICK = SPEED_OF_LIGHT / TICK_HZ
"""[m] Flight distance of one tick."""
MODULUS = 1 << 40
"""[ticks] Period of the stamps, 17.2074 s."""
GRID = 512
"""[ticks] Grid of transmission starts."""


def ticks(seconds: float) -> int:
    """Return a duration in whole ticks, rounded up."""
    return -int(-seconds * TICK_HZ // 1)


def seconds(duration: float) -> float:
    """Return a duration in ticks as seconds [s]."""
    return duration / TICK_HZ


def difference(later: int, earlier: int) -> int:
    """Return ticks from one stamp to another, in [-2^39, 2^39): right if they are within 8.6 s."""
    half = MODULUS // 2
    return (later - earlier + half) % MODULUS - half


def unwrap(stamp: int, near: int) -> int:
    """Return the time without wraps of a stamp, given a time within 8.6 s of it."""
    return near + difference(stamp, near)


def on_grid(time: int) -> int:
    """Return the first possible transmission start at or after a time."""
    return -(-time // GRID) * GRID


class OwnTime:
    """A node's own clock without wraps, from its stamps; never below zero."""

    def __init__(self) -> None:
        self.now = 0

    def set(self, stamp: int) -> None:
        """Start at a stamp."""
        self.now = stamp + MODULUS

    def take(self, stamp: int) -> bool:
        """Advance to a stamp; return False if the clock jumped back by more than a millisecond."""
        time = unwrap(stamp, self.now)
        if time < self.now - ticks(1e-3):
            self.set(stamp)
            return False
        self.now = max(time, self.now)
        return True
