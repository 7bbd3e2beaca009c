"""Which words of a car's controller are its own and new; the others are not listened to."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from hardware_bridge.config.swarm import CarConfig
from hardware_bridge.identity import Identities, Mark, Verdict
from hardware_bridge.readings import UNNAMED, Reading, Source


class Believed:
    """The line of one car."""

    def __init__(self, car: CarConfig, marks: Mapping[int, Mark]) -> None:
        """Begin with nothing heard.

        Args:
            car: Whose line it is.
            marks: Nothing as old as these is believed; see `Identities.restore`.
        """
        self._link, self._node, self._own = car.port.name, car.node, str(car.node)
        self._identities = Identities(authenticated=bool(car.key))
        self._identities.restore(marks)
        self._source: Source = UNNAMED
        self._accepted = False

    def sift(self, readings: Iterable[Reading], t_ns: int) -> Iterator[Reading]:
        """Those of the readings that are believed.

        Args:
            readings: As they were decoded.
            t_ns: When they came, by the host's monotonic clock [ns].
        """
        for reading in readings:
            source = reading.source
            if source.device not in (None, self._own):
                continue
            # A message is judged once, for all that it holds.
            if source is not self._source or source is UNNAMED:
                verdict: Verdict = self._identities.check(self._link, source, t_ns, self._node)
                self._source, self._accepted = source, verdict.accepted
            if self._accepted:
                yield reading
        self._identities.notices.clear()
