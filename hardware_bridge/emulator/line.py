"""Line from a device to the host: its port, and the faults of frames to the host."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from hardware_bridge.emulator.faults import FaultInjector
from hardware_bridge.emulator.ports import DevicePort


class Line:
    """Line that applies faults to frames to the host; bytes to the device pass unchanged."""

    def __init__(self, name: str, port: DevicePort, injector: FaultInjector) -> None:
        self.name, self.port, self.injector = name, port, injector
        self.frames = 0
        """Number of frames sent, before faults."""
        self._unplugged_until = -np.inf

    def send(self, t_ns: int, frames: Iterable[bytes]) -> None:
        """Queue frames, and write those that are due.

        Args:
            t_ns: Current host time.
            frames: Complete frames, in order.
        """
        for frame in frames:
            self.frames += 1
            self.injector.push(t_ns, frame)
        for frame in self.injector.due(t_ns):
            self.port.write(frame)

    def unplug(self, until: float) -> None:
        """Unplug until `replug_if_due` is called at or after world time `until` [s]."""
        self._unplugged_until = max(until, self._unplugged_until)
        self.injector.forget()
        self.port.unplug()

    def replug_if_due(self, t: float) -> None:
        """Plug in again if the world time `t` [s] is late enough."""
        if not self.port.plugged and t >= self._unplugged_until:
            self.port.replug()

    def close(self) -> None:
        """Unplug permanently."""
        self.port.unplug()
