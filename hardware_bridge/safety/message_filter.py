"""Filter for messages of a car's controller: foreign and repeated ones are dropped."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from hardware_bridge.config.swarm import CarConfig
from hardware_bridge.identity import Identities, Mark, Verdict
from hardware_bridge.readings import UNNAMED, Reading, Source


class MessageFilter:
    """Message filter of one car's port."""

    def __init__(self, car: CarConfig, marks: Mapping[int, Mark]) -> None:
        """Create a filter that has received nothing.

        Args:
            car: The car at this port.
            marks: Messages up to these marks are refused, see `Identities.restore`.
        """
        self._link, self._node, self._own = car.port.name, car.node, str(car.node)
        self._identities = Identities(authenticated=bool(car.key))
        self._identities.restore(marks)
        self._source: Source = UNNAMED
        self._accepted = False

    def sift(self, readings: Iterable[Reading], t_ns: int) -> Iterator[Reading]:
        """Yield the readings of accepted messages.

        Args:
            readings: Readings in the order of decoding.
            t_ns: Arrival, by the host's monotonic clock [ns].
        """
        for reading in readings:
            source = reading.source
            if source.device not in (None, self._own):
                continue
            # A message is checked once for all of its readings.
            if source is not self._source or source is UNNAMED:
                verdict: Verdict = self._identities.check(self._link, source, t_ns, self._node)
                self._source, self._accepted = source, verdict.accepted
            if self._accepted:
                yield reading
        self._identities.notices.clear()
