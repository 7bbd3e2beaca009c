"""What one node remembers of the others: when each was heard, by itself and by the rest."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from tracking.ranging.frames.timestamps import MODULUS, ticks, unwrap
from tracking.ranging.frames.wire import Entry, Frame

SLACK = ticks(5e-6)
"""Two clocks agree on one message as far as this and `DRIFT`."""
DRIFT = 100e-6
ELSEWHERE = ticks(50e-6)
"""A message reported later than the last one heard, by more than this, went past here."""
DOUBT = 16
"""So many slots long a node is waited for, once a silence was none."""
MAX_SILENCES = 2
"""But not in more slots in a row."""
PATIENCE = 3
"""After so many messages in a row that do not fit, the peer's clock must have jumped."""


@dataclass(slots=True)
class Peer:
    """The last message of one other node."""

    boot: int = 0
    sent: int = 0
    """When it left, the peer's clock without wraps."""
    heard: int = 0
    """When it arrived, own clock without wraps; 0 if only others have heard this peer."""
    reported: int = 0
    """When the last message left that anyone else heard, own clock."""
    rx_power: float = 0.0
    fp_power: float = 0.0
    fresh: bool = False
    """Heard since this node's own last message."""
    missed: int = 0
    """Rounds without a message of it."""
    misfits: int = 0
    """Messages in a row that do not fit its clock."""
    silences: int = 0
    """Slots of it in a row in which nothing was heard."""
    doubt: int = 0
    """Counts down from `DOUBT` since a silent slot after which it was heard again."""


class Peers:
    """All other nodes that were ever heard of."""

    def __init__(self) -> None:
        self._peers: dict[int, Peer] = {}

    def __iter__(self) -> Iterator[tuple[int, Peer]]:
        return iter(self._peers.items())

    def __getitem__(self, node: int) -> Peer:
        return self._peers[node]

    def forget(self) -> None:
        """Drop all."""
        self._peers.clear()

    def take(self, frame: Frame, arrived: int) -> bool | None:
        """Note a message that was heard.

        Returns:
            True if its stamp goes on from the last one; False if the clock begins again, since
            the peer is new, was switched on again or has jumped; None if the message is a
            repeated or late one and must be ignored.
        """
        peer = self._peers.setdefault(frame.src, Peer())
        peer.doubt = DOUBT if peer.silences else max(peer.doubt - 1, 0)
        peer.silences = 0
        if peer.heard and peer.boot == frame.boot:
            own = arrived - peer.heard
            sent = unwrap(frame.stamp, peer.sent + own)
            if own > 0 and self.same(sent - peer.sent, own, own):
                peer.sent, peer.heard, peer.misfits = sent, arrived, 0
                return True
            peer.misfits += 1
            if peer.misfits < PATIENCE:
                return None
        peer.boot, peer.sent, peer.heard, peer.misfits = frame.boot, frame.stamp, arrived, 0
        return False

    def report(self, node: int, when: int) -> None:
        """Note that another node heard a message that left at a time of the own clock."""
        peer = self._peers.setdefault(node, Peer())
        peer.reported = max(peer.reported, when)

    @staticmethod
    def same(a: int, b: int, span: int) -> bool:
        """Whether two clocks mean the same moment, a span away from one that they share."""
        return abs(a - b) <= SLACK + DRIFT * span

    def hidden(self, node: int, since: int) -> bool:
        """Whether others hear a node that this one does not: its last message went past here."""
        peer = self._peers.get(node)
        return peer is not None and peer.reported > max(peer.heard + ELSEWHERE, since)

    def note_silence(self, node: int) -> bool:
        """Note a silent slot; True if the node may be speaking all the same, as it was before."""
        peer = self._peers.get(node)
        if peer is None:
            return False
        peer.silences += 1
        return peer.doubt > 0 and peer.silences <= MAX_SILENCES

    def alive(self, node: int, since: int) -> bool:
        """Whether anyone has heard a node since a time of the own clock."""
        peer = self._peers[node]
        return max(peer.heard, peer.reported) > since

    def table(self, members: tuple[int, ...], most: int) -> list[Entry]:
        """At most `most` rows of the next message: the members, then other nodes received."""
        others = sorted(k for k, peer in self if peer.fresh and k not in members)
        return [self._row(k) for k in (*members, *others)][:most]

    def spoken(self) -> None:
        """The own message is on its way: what is heard from now on goes into the next."""
        for _, peer in self:
            peer.fresh = False

    def _row(self, node: int) -> Entry:
        peer = self._peers.get(node)
        if peer is None or not peer.fresh:
            return Entry(node, None)
        return Entry(node, peer.heard % MODULUS, peer.rx_power, peer.fp_power)
