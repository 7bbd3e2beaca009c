"""A device's line to the host: its port, and what happens to frames on the way to it."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from hardware_bridge.emulator.faults import FaultInjector
from hardware_bridge.emulator.ports import DevicePort


class Line:
    """Frames go in, bytes come out at the host; the other way round bytes come as they are."""

    def __init__(self, name: str, port: DevicePort, injector: FaultInjector) -> None:
        self.name, self.port, self.injector = name, port, injector
        self.frames = 0
        """Sent so far, before anything happens to them."""
        self._unplugged_until = -np.inf

    def send(self, t_ns: int, frames: Iterable[bytes]) -> None:
        """Let frames set out, and write those that have arrived.

        Args:
            t_ns: Now, of the host.
            frames: Whole ones, in order.
        """
        for frame in frames:
            self.frames += 1
            self.injector.push(t_ns, frame)
        for frame in self.injector.due(t_ns):
            self.port.write(frame)

    def unplug(self, until: float) -> None:
        """Pull the plug until `replug_if_due` is called at or after `until` of the world [s]."""
        self._unplugged_until = max(until, self._unplugged_until)
        self.injector.forget()
        self.port.unplug()

    def replug_if_due(self, t: float) -> None:
        """Plug in again when it is time [s]."""
        if not self.port.plugged and t >= self._unplugged_until:
            self.port.replug()

    def close(self) -> None:
        """Unplug for good."""
        self.port.unplug()
