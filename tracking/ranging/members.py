"""Members of a round, by rising ID: the routing table."""

from __future__ import annotations

from tracking.ranging.frames.wire import Frame
from tracking.ranging.peers import Peers

MAX_MEMBERS = 62
"""Most members of a round: the nodes with the smallest IDs."""


class Members:
    """Members that one node knows; the initiator decides, the others read its table."""

    def __init__(self, node_id: int) -> None:
        self._id = node_id
        self._rows: list[int] = []
        self._source = node_id, 0, 0
        self._asked = 0, 0
        self.ids: tuple[int, ...] = (node_id,)

    def __len__(self) -> int:
        return len(self.ids)

    def __contains__(self, node: int) -> bool:
        return node in self.ids

    def others(self) -> tuple[int, ...]:
        """Return all members except this node."""
        return tuple(k for k in self.ids if k != self._id)

    def read(self, frame: Frame) -> tuple[int, ...] | None:
        """Return the members in a request or reply; None until all parts of its table arrived."""
        ids = [e.id for e in frame.entries]
        if frame.part == 0:
            self._rows = ids
        elif self._source == (frame.src, frame.round, frame.part - 1):
            self._rows = self._rows + ids
        else:
            return None
        self._source = frame.src, frame.round, frame.part
        if frame.part + 1 < frame.parts or len(self._rows) < frame.n - 1:
            return None
        return tuple(sorted({*self._rows[: frame.n - 1], frame.src}))

    def ask_first(self, now: int) -> None:
        """Start as initiator: all members count as present."""
        self._asked = now, now

    def renew(self, peers: Peers, at: int, drop_after: int) -> None:
        """Decide the members of the next round: nodes received in the last one stay or join.

        Args:
            peers: Nodes received by this node or by others.
            at: Start of the next round, own clock.
            drop_after: Rounds without a message of a member until it is dropped.
        """
        # Receptions of the last member are reported a round later: look two rounds back.
        since, self._asked = self._asked[0], (self._asked[1], at)
        ids = {self._id, *self.ids}
        for k, peer in peers:
            if peers.alive(k, since):
                peer.missed = 0
                ids.add(k)
            else:
                peer.missed += 1
                if peer.missed >= drop_after:
                    ids.discard(k)
        self.ids = tuple(sorted(ids)[:MAX_MEMBERS])
