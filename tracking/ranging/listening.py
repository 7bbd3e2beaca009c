"""Evaluation of received messages by one node: peers, and ranges of all pairs.

Every message has its transmit time and the times at which its sender received the others. A node
that also received these messages knows both of their ends, and so the range of two other nodes.
"""

from __future__ import annotations

from tracking.errors import WireError
from tracking.ranging.events import MotionEvent, Reception
from tracking.ranging.exchange import ExchangeParams, Exchanges, Passage, RangeEvent
from tracking.ranging.frames.motion import AGE_UNIT, decode_motion
from tracking.ranging.frames.timestamps import MODULUS, TICK_HZ, difference
from tracking.ranging.frames.wire import Entry, Frame
from tracking.ranging.peers import Peer, Peers


class Listener:
    """Receiver of one node."""

    def __init__(self, node_id: int, params: ExchangeParams) -> None:
        self._id = node_id
        self.peers = Peers()
        self._exchanges = Exchanges(params)
        self._last_sent: int | None = None

    def forget(self) -> None:
        """Reset, after a jump of the own clock or a reset of the node."""
        self.peers.forget()
        self._exchanges.forget()
        self._last_sent = None

    def note_sent(self, sent: int) -> None:
        """Record the transmit time of the own message, own clock."""
        self._last_sent = sent
        self.peers.begin_table()

    def take(
        self, frame: Frame, reception: Reception, arrived: int
    ) -> list[RangeEvent | MotionEvent] | None:
        """Process a message that arrived at a time of the own clock.

        Returns:
            The ranges that it completes, and its motion; None for a repeated or late message.
        """
        goes_on = self.peers.take(frame, arrived)
        if goes_on is None:
            return None
        if not goes_on:
            self._exchanges.forget(frame.src)
        src = self.peers[frame.src]
        src.rx_power, src.fp_power, src.fresh = reception.rx_power, reception.fp_power, True
        events: list[RangeEvent | MotionEvent | None]
        events = [self._overhear(frame, src, row, arrived) for row in frame.entries]
        events.append(self._receive(frame, src, reception, arrived))
        events.append(self._read_motion(frame, arrived))
        return [event for event in events if event is not None]

    @staticmethod
    def _read_motion(frame: Frame, arrived: int) -> MotionEvent | None:
        """Return the motion of a message; None without one, or if it is invalid."""
        if not frame.motion:
            return None
        try:
            motion = decode_motion(frame.motion)
        except WireError:
            return None
        at = arrived - round(motion.age * AGE_UNIT * TICK_HZ)
        return MotionEvent(frame.src, frame.boot, at % MODULUS, motion)

    def _overhear(self, frame: Frame, src: Peer, row: Entry, arrived: int) -> RangeEvent | None:
        """Process one row of a table: the time at which the sender received that node."""
        if row.stamp is None:
            return None
        ago = difference(frame.stamp, row.stamp)
        if ago <= 0:
            return None
        when, received = arrived - ago, src.sent - ago
        if row.id == self._id:
            sent = local = self._last_sent or 0
        else:
            self.peers.report(row.id, when)
            sent, local = self.peers[row.id].sent, self.peers[row.id].received
        if not local or not self.peers.same(when, local, ago):
            return None  # not of the last message received here
        passage = Passage(sent, received, local)
        result = self._exchanges.add(row.id, frame.src, passage)
        return self._event(result, (frame.src, row.id), (row.rx_power, row.fp_power))

    def _receive(
        self, frame: Frame, src: Peer, reception: Reception, arrived: int
    ) -> RangeEvent | None:
        """Process the reception by this node; of several parts the last counts."""
        if reception.carrier is not None:
            self._exchanges.carrier(self._id, frame.src, arrived, reception.carrier)
        if frame.part + 1 < frame.parts:
            return None
        result = self._exchanges.add(frame.src, self._id, Passage(src.sent, arrived, arrived))
        return self._event(result, (self._id, frame.src), (reception.rx_power, reception.fp_power))

    @staticmethod
    def _event(
        result: tuple[float, int] | None, pair: tuple[int, int], powers: tuple[float, float]
    ) -> RangeEvent | None:
        if result is None:
            return None
        distance, time = result
        return RangeEvent(*pair, time % MODULUS, distance, *powers)
