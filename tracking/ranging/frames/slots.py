"""Durations of the protocol in ticks, for one radio setting."""

from __future__ import annotations

from functools import lru_cache

from tracking.ranging.frames.airtime import Phy, airtime, message_time
from tracking.ranging.frames.timestamps import ticks
from tracking.ranging.frames.wire import FIXED_BYTES


class Slots:
    """Expected times of the next message after a received one.

    Times of messages are those of their stamps, `header` after the start of the frame.
    """

    def __init__(self, phy: Phy) -> None:
        self._phy = phy
        self.header = ticks(phy.header_time)
        self.sense = ticks(phy.sense)
        self.turnaround = ticks(phy.turnaround)
        self.gap = ticks(phy.gap)
        self.silent = ticks(phy.sense + phy.turnaround)
        """Duration of a slot in which no node transmits."""
        self.join = ticks(airtime(phy, FIXED_BYTES) + phy.gap)
        """Duration of a message without a table, with its gap."""
        self.longest = ticks(airtime(phy, phy.max_frame) + phy.gap)
        self.frame = lru_cache(maxsize=None)(self._frame)
        self.message = lru_cache(maxsize=None)(self._message)

    def _frame(self, frame_bytes: int) -> int:
        """Return the duration of a frame of `frame_bytes` bytes."""
        return ticks(airtime(self._phy, frame_bytes))

    def _message(self, n_nodes: int) -> int:
        """Return the slot length of n nodes: a message with its gap."""
        return ticks(message_time(self._phy, n_nodes))
