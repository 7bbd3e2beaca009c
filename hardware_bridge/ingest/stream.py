"""What is known of one port that measures, or of a car's telemetry."""

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
"""What a car's controller can say; nothing else is believed on its line."""


@dataclass(slots=True)
class Stream:
    """What is known of one port."""

    name: str
    decoder: Decoder
    node: int | None
    """Id of the sender, where the format does not name it."""
    ids: dict[str, int]
    identities: Identities
    is_car: bool = False
    """Of a car's controller: no other device sends there."""
    scanner: ScannerMount | None = None
    """Where it is on its car, if it is one."""
    times: dict[int, StreamTime] = field(default_factory=dict)
    """By node index."""
    clocks: dict[int, DeviceClock] = field(default_factory=dict)
    """The counter of `times`, by node index; none where they are times of arrival."""
    other: dict[int, DeviceClock | None] = field(default_factory=dict)
    """Another counter that the last stamp was of, by node index."""
    even: dict[int, EvenTime] = field(default_factory=dict)
    """Times of samples without stamps, by node index."""
    source: Source | None = None
    """Of the last reading: those of one message share it, and are taken or refused together."""
    verdict: Verdict = Verdict.UNNUMBERED
    t_ns: int = 0

    def clock(self, node: int, source: Source) -> StreamTime:
        """What maps the stamps of a node, by its index: a new one where they change their counter.

        A single stamp of another counter is a damaged one, and counts as when it came.
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
