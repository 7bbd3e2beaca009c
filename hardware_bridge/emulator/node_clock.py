"""Clock of an emulated device, with offset, drift, jumps and wraps."""

from __future__ import annotations

import math

from hardware_bridge.readings import DeviceClock


class NodeClock:
    """Conversion of world time to seconds and ticks of a device."""

    def __init__(self, offset: float = 0.0, drift: float = 0.0) -> None:
        """Create a clock.

        Args:
            offset: Reading at the start of the world [s].
            drift: Relative rate error, positive if fast [-]; 20e-6 is 20 ppm.
        """
        self.offset, self.drift = offset, drift
        self._began = 0.0

    def seconds(self, t: float) -> float:
        """Return the reading at world time `t` [s], before it wraps."""
        return (t - self._began) * (1.0 + self.drift) + self.offset

    def ticks(self, t: float, clock: DeviceClock) -> int:
        """Return the count of a counter driven by this clock at world time `t` [s]."""
        return math.floor(self.seconds(t) * clock.hz) % clock.modulus

    def step(self, seconds: float) -> None:
        """Jump by some seconds, forwards or backwards."""
        self.offset += seconds

    def restart(self, t: float) -> None:
        """Restart from 0 at world time `t` [s]."""
        self._began, self.offset = t, 0.0
