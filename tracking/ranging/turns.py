"""TDMA: the slots of a round as one node sees them pass."""

from __future__ import annotations

from enum import Enum

from tracking.ranging.dice import Dice
from tracking.ranging.frames.slots import Slots
from tracking.ranging.frames.timestamps import ticks
from tracking.ranging.members import Members
from tracking.ranging.params import SessionParams
from tracking.ranging.peers import Peers

OPEN = 128
"""Number of rounds after which a round ends with a free slot, for newcomers that the initiator
cannot receive because both would always transmit at the same time."""
CHECK_ROUNDS = 64
"""Least number of rounds between two checks of the own slot."""


class Waiting(Enum):
    """Purposes of the deadline."""

    START = "no other node may be there: become initiator"
    FRAME = "a frame is coming in"
    TURN = "own turn: transmit if the gap stays silent"
    SLOT = "the slot is silent if no preamble comes"
    PART = "the next part of a message should come"
    TAKEOVER = "the request is missing: take over"
    WATCHDOG = "begin again"


class Turns:
    """Slot cursor of one node. Times are stamps of the own clock without wraps.

    Slot k belongs to member k; slot 0, and every slot after the last member, belongs to the
    initiator's request.
    """

    def __init__(
        self,
        node_id: int,
        params: SessionParams,
        slots: Slots,
        members: Members,
        peers: Peers,
        dice: Dice,
    ) -> None:
        self._id, self._params, self._slots = node_id, params, slots
        self._members, self._peers, self._dice = members, peers, dice
        self.cursor = 0
        """Index of the next slot."""
        self.expected = 0
        """Stamp moment of the next slot's message."""
        self.waiting = self.before = Waiting.START
        """Purpose of the deadline, and the purpose before a frame came in."""
        self.deadline = self.received_at = self.check_at = 0
        """End of the wait; last reception of a valid frame; time from which to listen in the own
        slot."""
        self._held_deadline = 0
        self._opened = -1
        self.foreign = False
        """True if the incoming frame was not of this group's slots: it took only time."""

    @property
    def at_request(self) -> bool:
        """True if the initiator's request is next."""
        return self.cursor >= len(self._members)

    def wait(self, waiting: Waiting, deadline: int) -> None:
        """Set the purpose and the time of the deadline."""
        self.waiting, self.deadline = waiting, deadline

    def hold(self, now: int) -> None:
        """Wait for the end of an incoming frame."""
        if self.waiting is not Waiting.FRAME:
            self.before, self._held_deadline = self.waiting, self.deadline
            # A newcomer transmits before the member of the slot.
            self.foreign = now < self.expected - self._slots.header
        self.wait(Waiting.FRAME, now + self._slots.longest + self._slots.header)

    def resume(self) -> None:
        """Restore the wait before a frame that changes nothing."""
        self.wait(self.before, self._held_deadline)

    def await_slot(self, now: int, round: int, *, leads: bool, shut_out: bool) -> None:
        """Wait for the slot at the cursor.

        Args:
            now: Current time.
            round: Number of the round; every `OPEN`-th one ends with a slot for newcomers.
            leads: True if this node is the initiator.
            shut_out: True if this node is a newcomer whose attempts have failed.
        """
        s = self._slots
        mine = leads if self.at_request else self._members.ids[self.cursor] == self._id
        if self.at_request and round % OPEN == OPEN - 1 and round != self._opened:
            self._opened = round
            self.expected += s.join if leads else 0
            mine |= shut_out
        if mine and now >= self.check_at:
            rounds = CHECK_ROUNDS * len(self._members) * s.message(len(self._members))
            self.check_at = now + max(self._dice.pause(self._params.check), rounds)
            mine = leads  # a responder listens in its slot, an initiator a little longer
            self.expected += s.message(len(self._members)) if leads else 0
        if mine:
            self.wait(Waiting.TURN, self.expected - s.header - s.gap + s.sense)
        else:
            self.wait(Waiting.SLOT, self.expected - s.header + s.sense)

    def silent(self, now: int, root: int) -> bool:
        """Go on to the next slot after a slot without a preamble.

        Args:
            now: Current time.
            root: Initiator that this node follows.

        Returns:
            False if it was the slot of the request and the initiator is silent everywhere.
        """
        n, missing = len(self._members), self.at_request
        node = root if missing else self._members.ids[self.cursor]
        since = now - 2 * n * self._slots.message(n)
        waits = node != self._id and self._peers.hidden(node, since)
        if missing and not waits:
            return False
        if node != self._id and not missing:
            waits |= self._peers.note_silence(node)
        self.expected += self._slots.message(n) if waits else self._slots.silent
        self.cursor = 1 if missing else self.cursor + 1
        return True

    def unreadable(self, now: int, *, follows: bool) -> None:
        """Handle an unreadable transmission; it took the slot unless it was early.

        Args:
            now: Current time, the end of the transmission.
            follows: True if this node is a responder.
        """
        self.expected = now + self._slots.gap + self._slots.header
        if not self.foreign and self.before is not Waiting.PART:
            self.cursor = 1 if self.at_request and follows else self.cursor + 1

    def request_missing(self, root: int) -> None:
        """Wait for one's position in the succession after a missing request."""
        self.wait(Waiting.WATCHDOG, self.received_at + ticks(self._params.watchdog))
        heirs = [k for k in self._members.ids if k != root]
        if self._params.succession and self._id in heirs:
            patience = self._params.takeover * (heirs.index(self._id) + 1)
            takeover = self.expected + int(patience * self._slots.message(len(self._members)))
            if takeover < self.deadline:
                self.wait(Waiting.TAKEOVER, takeover)
