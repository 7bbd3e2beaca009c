"""Velocity trims by operators with a remote control, added to the plan."""

from __future__ import annotations

import math
from collections import Counter

from hardware_bridge.ingest.naming import Naming
from hardware_bridge.ingest.stream import Stream
from hardware_bridge.readings import UNNAMED, OperatorReading

NO_NODE = -1
"""Node id used for an operator without an id."""


class Trims:
    """The newest trim of each car."""

    def __init__(self, naming: Naming, refused: Counter[str]) -> None:
        """Create an empty table of trims.

        Args:
            naming: Names of devices to indices of nodes.
            refused: Counter of refused readings, by reason; continued.
        """
        self.newest: dict[int, tuple[int, tuple[float, float]]] = {}
        """Host time of arrival [ns] and velocity in the world frame [m/s], by index of the node."""
        self._naming, self._refused = naming, refused

    def take(self, stream: Stream, reading: OperatorReading, arrival_ns: int) -> None:
        """Store a reading if its message is accepted; non-finite velocities are ignored.

        Args:
            stream: Stream of the reading.
            reading: The trim of one car.
            arrival_ns: Host time of arrival [ns].
        """
        source, device = reading.source, reading.source.device
        if source is not stream.source or source is UNNAMED:
            # A remote control is not a node; it has an id of its own.
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
