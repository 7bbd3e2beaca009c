"""Memory of one node about the others: last reception by itself and by others."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from tracking.ranging.frames.timestamps import MODULUS, ticks, unwrap
from tracking.ranging.frames.wire import Entry, Frame

SLACK = ticks(5e-6)
"""[ticks] Largest difference of two clocks about one message, in addition to `DRIFT`."""
DRIFT = 100e-6
ELSEWHERE = ticks(50e-6)
"""[ticks] Delay after the last reception from which a reported message was missed here."""
DOUBT = 16
"""[slots] Time for which a node is waited for after a silent slot was followed by its message."""
MAX_SILENCES = 2
"""Largest number of consecutive slots for such waits."""
PATIENCE = 3
"""Number of consecutive misfits from which the peer's clock has jumped."""


@dataclass(slots=True)
class Peer:
    """The last message of one other node."""

    boot: int = 0
    sent: int = 0
    """Transmit time, the peer's clock without wraps."""
    received: int = 0
    """Receive time, own clock without wraps; 0 if only others have received this peer."""
    reported: int = 0
    """Transmit time of its last message that any other node received, own clock."""
    rx_power: float = 0.0
    fp_power: float = 0.0
    fresh: bool = False
    """True if received since this node's own last message."""
    missed: int = 0
    """Number of rounds without a message of the peer."""
    misfits: int = 0
    """Number of consecutive messages that do not fit its clock."""
    silences: int = 0
    """Number of consecutive slots of the peer without a reception."""
    doubt: int = 0
    """Counts down from `DOUBT` after a reception that followed a silent slot."""


class Peers:
    """All other nodes that were received or reported."""

    def __init__(self) -> None:
        self._peers: dict[int, Peer] = {}

    def __iter__(self) -> Iterator[tuple[int, Peer]]:
        return iter(self._peers.items())

    def __getitem__(self, node: int) -> Peer:
        return self._peers[node]

    def forget(self) -> None:
        """Drop all peers."""
        self._peers.clear()

    def take(self, frame: Frame, arrived: int) -> bool | None:
        """Record a received message.

        Returns:
            True if its stamp continues the last one; False if the clock restarts, since the peer
            is new, was switched on again or has jumped; None for a repeated or late message, to
            be ignored.
        """
        peer = self._peers.setdefault(frame.src, Peer())
        peer.doubt = DOUBT if peer.silences else max(peer.doubt - 1, 0)
        peer.silences = 0
        if peer.received and peer.boot == frame.boot:
            own = arrived - peer.received
            sent = unwrap(frame.stamp, peer.sent + own)
            if own > 0 and self.same(sent - peer.sent, own, own):
                peer.sent, peer.received, peer.misfits = sent, arrived, 0
                return True
            peer.misfits += 1
            if peer.misfits < PATIENCE:
                return None
        peer.boot, peer.sent, peer.received, peer.misfits = frame.boot, frame.stamp, arrived, 0
        return False

    def report(self, node: int, when: int) -> None:
        """Record that another node received a message sent at a time of the own clock."""
        peer = self._peers.setdefault(node, Peer())
        peer.reported = max(peer.reported, when)

    @staticmethod
    def same(a: int, b: int, span: int) -> bool:
        """Return whether two times mean the same moment, `span` after a moment that both share."""
        return abs(a - b) <= SLACK + DRIFT * span

    def hidden(self, node: int, since: int) -> bool:
        """Return whether others receive a node whose last message was missed here."""
        peer = self._peers.get(node)
        return peer is not None and peer.reported > max(peer.received + ELSEWHERE, since)

    def note_silence(self, node: int) -> bool:
        """Record a silent slot; return True if the node may be transmitting, as it was before."""
        peer = self._peers.get(node)
        if peer is None:
            return False
        peer.silences += 1
        return peer.doubt > 0 and peer.silences <= MAX_SILENCES

    def alive(self, node: int, since: int) -> bool:
        """Return whether any node has received a node since a time of the own clock."""
        peer = self._peers[node]
        return max(peer.received, peer.reported) > since

    def table(self, members: tuple[int, ...], most: int) -> list[Entry]:
        """Return at most `most` rows of the next message: members, then other received nodes."""
        others = sorted(k for k, peer in self if peer.fresh and k not in members)
        return [self._row(k) for k in (*members, *others)][:most]

    def begin_table(self) -> None:
        """Start a new table after the own message: later receptions are in the next one."""
        for _, peer in self:
            peer.fresh = False

    def _row(self, node: int) -> Entry:
        peer = self._peers.get(node)
        if peer is None or not peer.fresh:
            return Entry(node, None)
        return Entry(node, peer.received % MODULUS, peer.rx_power, peer.fp_power)
