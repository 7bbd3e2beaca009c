"""Reports of the external tracker: their nodes, times and acceptance."""

from __future__ import annotations

from collections import Counter

from hardware_bridge.clocks import DeviceTime
from hardware_bridge.external_tracker.frozen_positions import StuckPlaces
from hardware_bridge.external_tracker.pending import PendingReports
from hardware_bridge.ingest.naming import Naming
from hardware_bridge.ingest.stream import Stream
from hardware_bridge.plausibility import Plausibility
from hardware_bridge.readings import MICROSECONDS_64, PairReading, PoseReading
from tracking.estimate import Status

NS = 1e-9
OF_STREAM = -1
"""Key in place of a node: one clock stamps all lines."""


class OtherTracker:
    """Reader of lines about pairs and nodes, from any links."""

    def __init__(
        self,
        start_ns: int,
        ids: tuple[int, ...],
        naming: Naming,
        plausibility: Plausibility,
        refused: Counter[str],
        notices: list[tuple[int, str]],
    ) -> None:
        """Create a reader without reports.

        Args:
            start_ns: Host time of 0 s in the reports [ns].
            ids: Ids of the nodes, by index.
            naming: Mapping of names to nodes.
            plausibility: Plausibility checks.
            refused: Counter of refused lines.
            notices: List that notices to the user are added to.
        """
        self._start_ns, self._ids = start_ns, ids
        self._naming, self._plausibility = naming, plausibility
        self._refused, self._notices = refused, notices
        self._stuck = StuckPlaces()
        self.pending = PendingReports()
        """Accepted reports that were not processed yet."""
        self.driving: frozenset[int] = frozenset()
        """Indices of driving nodes, by wheels or permitted commands; written by the caller."""

    def take(
        self, stream: Stream, reading: PairReading | PoseReading, arrival_ns: int
    ) -> tuple[int, ...]:
        """Process a line; return the indices of the nodes whose positions it reports."""
        names = (reading.i, reading.j) if isinstance(reading, PairReading) else (reading.node,)
        found = [
            self._naming.index(stream, name, arrival_ns, named=True, mixed=True) for name in names
        ]
        nodes = tuple(node for node in found if node is not None)
        clock = stream.times.setdefault(OF_STREAM, DeviceTime(MICROSECONDS_64))
        t_ns = clock.map(reading.source.ticks, arrival_ns)
        if len(set(nodes)) < len(names):
            return ()
        if reading.pos is not None and not self._is_plausible(reading, nodes, t_ns, arrival_ns):
            return ()
        t = (t_ns - self._start_ns) * NS
        if isinstance(reading, PoseReading):
            self.pending.add_pose(t, nodes[0], reading)
            return nodes
        self.pending.add_pair(t, nodes, reading)
        return () if reading.status in (Status.LOST, Status.ABSENT) else nodes

    def _is_plausible(
        self, reading: PairReading | PoseReading, nodes: tuple[int, ...], t_ns: int, arrival_ns: int
    ) -> bool:
        """Return whether a position is plausible and its tracker is not frozen."""
        assert reading.pos is not None
        if not self._plausibility.allows_place(nodes, reading.pos, t_ns):
            return False
        attitude = reading.q_wb if isinstance(reading, PoseReading) else None
        known, drives = nodes in self._stuck.stuck, not self.driving.isdisjoint(nodes)
        values = (*reading.pos, *(attitude or ()))
        if not self._stuck.refuses(nodes, values, drives, arrival_ns):
            return True
        self._refused["stuck"] += 1
        if not known:
            who = " and ".join(str(self._ids[node]) for node in nodes)
            text = f"the place of {who} stays the same while it drives: its tracker hangs"
            self._notices.append((arrival_ns, text))
        return False
