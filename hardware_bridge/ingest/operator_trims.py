"""What operators ask of the cars by remote control: velocities on top of the plan."""

from __future__ import annotations

import math
from collections import Counter

from hardware_bridge.ingest.naming import Naming
from hardware_bridge.ingest.stream import Stream
from hardware_bridge.readings import UNNAMED, OperatorReading

NO_NODE = -1
"""In place of an id, of an operator without."""


class Trims:
    """The newest of each car."""

    def __init__(self, naming: Naming, refused: Counter[str]) -> None:
        """Begin with none.

        Args:
            naming: Names of devices to indices of nodes.
            refused: Readings that were not used, by reason; counted on.
        """
        self.newest: dict[int, tuple[int, tuple[float, float]]] = {}
        """By index of the node: host time of arrival [ns], velocity in the world frame [m/s]."""
        self._naming, self._refused = naming, refused

    def take(self, stream: Stream, reading: OperatorReading, arrival_ns: int) -> None:
        """Take a reading if its message is accepted; velocities that are not finite are left out.

        Args:
            stream: It came on.
            reading: What is asked of one car.
            arrival_ns: Host time [ns].
        """
        source, device = reading.source, reading.source.device
        if source is not stream.source or source is UNNAMED:
            # A remote control is none of the nodes; it has an id of its own.
            who = int(device) if device and device.isascii() and device.isdigit() else NO_NODE
            stream.verdict = stream.identities.check(stream.name, source, arrival_ns, who)
            stream.source = source
            if not stream.verdict.accepted:
                self._refused[stream.verdict.value] += 1
        if not stream.verdict.accepted:
            return
        node = self._naming.index(stream, reading.to, arrival_ns, named=True)
        if node is not None and all(map(math.isfinite, reading.velocity)):
            self.newest[node] = arrival_ns, reading.velocity
