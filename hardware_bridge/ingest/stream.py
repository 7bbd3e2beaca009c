"""State of one port that measures, or of a car's telemetry."""

from __future__ import annotations

from dataclasses import dataclass, field

from hardware_bridge.clocks import DeviceTime, EvenTime, HostTime, StreamTime
from hardware_bridge.decoders.base import Decoder
from hardware_bridge.identity import Identities, Verdict
from hardware_bridge.ingest.scanner import ScannerMount
from hardware_bridge.readings import (
    AckReading,
    DeviceClock,
    HeartbeatReading,
    MotionReading,
    NearReading,
    Source,
    StatusReading,
)

OF_A_CAR = (MotionReading, NearReading, StatusReading, AckReading, HeartbeatReading)
"""Readings that a car's controller may send; others are refused on its line."""


@dataclass(slots=True)
class Stream:
    """State of one port."""

    name: str
    decoder: Decoder
    node: int | None
    """Node id of the sender, for formats that do not name it."""
    ids: dict[str, int]
    identities: Identities
    is_car: bool = False
    """True for the port of a car's controller: no other device sends there."""
    scanner: ScannerMount | None = None
    """Mounting on the car, for scanners."""
    times: dict[int, StreamTime] = field(default_factory=dict)
    """Conversions of stamps to host time, by node index."""
    clocks: dict[int, DeviceClock] = field(default_factory=dict)
    """Counter of each conversion in `times`, by node index; none for arrival times."""
    other: dict[int, DeviceClock | None] = field(default_factory=dict)
    """Differing counter of the last stamp, by node index."""
    even: dict[int, EvenTime] = field(default_factory=dict)
    """Times of samples without stamps, by node index."""
    source: Source | None = None
    """Source of the last reading: readings of a message share it, and one verdict."""
    verdict: Verdict = Verdict.UNNUMBERED
    t_ns: int = 0

    def clock(self, node: int, source: Source) -> StreamTime:
        """Return the conversion of a node's stamps, by its index: a new one if the counter changes.

        A single stamp of another counter is considered damaged and mapped to its arrival.
        """
        counter = None if source.ticks is None else source.clock
        if node in self.times:
            known = self.clocks.get(node)
            again = self.other.get(node) == counter
            self.other[node] = None if counter == known else counter
            if counter is None or counter == known:
                return self.times[node]
            if not again:
                return HostTime()
        if counter is None:
            self.times[node] = HostTime()
        else:
            self.times[node], self.clocks[node] = DeviceTime(counter), counter
        return self.times[node]
