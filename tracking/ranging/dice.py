"""Pseudorandom backoff of a node, so that two nodes draw different pauses."""

from __future__ import annotations

from tracking.ranging.frames.timestamps import ticks


class Dice:
    """A linear congruential generator (Numerical Recipes, section 7.1); high bits are used."""

    def __init__(self, node_id: int, boot: int) -> None:
        self._state = (boot * 2654435761 + node_id + 1) % (1 << 32)

    def bits(self, n: int) -> int:
        """Return n random bits, up to 32."""
        self._state = (1664525 * self._state + 1013904223) % (1 << 32)
        return self._state >> (32 - n)

    def pause(self, interval: tuple[float, float]) -> int:
        """Return a random duration [ticks] within an interval [s]."""
        low, high = ticks(interval[0]), ticks(interval[1])
        return low + (self.bits(20) * (high - low) >> 20)
