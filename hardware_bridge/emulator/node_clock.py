"""The clock of an emulated device: it starts somewhere, runs fast or slow, jumps, and wraps."""

from __future__ import annotations

import math

from hardware_bridge.readings import DeviceClock


class NodeClock:
    """Seconds of the world to seconds and ticks of a device."""

    def __init__(self, offset: float = 0.0, drift: float = 0.0) -> None:
        """Set it.

        Args:
            offset: What it shows when the world begins [s].
            drift: How much too fast it runs [-]; 20e-6 is 20 ppm.
        """
        self.offset, self.drift = offset, drift
        self._began = 0.0

    def seconds(self, t: float) -> float:
        """What it shows at `t` of the world [s], before it wraps."""
        return (t - self._began) * (1.0 + self.drift) + self.offset

    def ticks(self, t: float, clock: DeviceClock) -> int:
        """What a counter of this clock shows at `t` of the world [s]."""
        return math.floor(self.seconds(t) * clock.hz) % clock.modulus

    def step(self, seconds: float) -> None:
        """Jump ahead, or back."""
        self.offset += seconds

    def restart(self, t: float) -> None:
        """Show 0 at `t` of the world [s]."""
        self._began, self.offset = t, 0.0
