"""What a node says of the others, for a computer that decides alone."""

from __future__ import annotations

from collections import Counter

from hardware_bridge.ingest.naming import Naming
from hardware_bridge.ingest.stream import Stream
from hardware_bridge.plausibility import Plausibility
from hardware_bridge.readings import PeerReading

OLDEST = 1.0
"""[s] Largest age of the motion of another node."""


class Peers:
    """Choice of the messages that a computer uses: of its own node, about the others.

    The tracker of a group has the samples of all nodes, which say more than their motion.
    """

    def __init__(
        self, alone: int | None, naming: Naming, plausibility: Plausibility, refused: Counter[str]
    ) -> None:
        """Choose for a node.

        Args:
            alone: Index of the node whose computer this is; None for a group.
            naming: Names of devices.
            plausibility: Limits of the values.
            refused: Counter of refused readings; those of other nodes are counted here.
        """
        self._alone, self._naming = alone, naming
        self._plausibility, self._refused = plausibility, refused

    def are_measured_elsewhere(self, stream: Stream, node: int) -> bool:
        """Return whether measurements are of another node than the own, which are not used."""
        is_other = self._alone not in (None, node) and not stream.is_car
        if is_other:
            self._refused["other_node"] += 1
        return is_other

    def node_of(
        self, stream: Stream, reading: PeerReading, sender: int, arrival_ns: int
    ) -> int | None:
        """Return the index of the node whose motion it is; None if it is not used."""
        node = self._naming.index(stream, reading.of, arrival_ns, named=True)
        if node in (None, sender) or self._alone is None or reading.age > OLDEST:
            return None
        # Motion may repeat: a node at rest sends the same again and again.
        return node if self._plausibility.allows_state(reading) else None
