"""Conversion of messages to frames with exact times, split if one frame is too short."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from tracking.ranging.events import Transmission
from tracking.ranging.frames.slots import Slots
from tracking.ranging.frames.timestamps import MODULUS, on_grid
from tracking.ranging.frames.wire import (
    MAX_PARTS,
    Entry,
    Frame,
    Type,
    encode,
    entries_per_frame,
    split,
)
from tracking.ranging.params import SessionParams


@dataclass(frozen=True, slots=True)
class Words:
    """A message without its bytes and times."""

    type: Type
    root: int
    round: int
    slot: int
    n: int
    rows: Sequence[Entry] = ()


class Transmitter:
    """Transmitter of one node."""

    def __init__(self, node_id: int, params: SessionParams, slots: Slots, boot: int) -> None:
        self._id, self._params, self._slots, self._boot = node_id, params, slots, boot
        self._sequence = 0
        self.room = MAX_PARTS * entries_per_frame(params.phy.max_frame)
        """Number of rows that a message can have."""

    def say(self, words: Words, at: int) -> tuple[list[Transmission], int, int]:
        """Build the frames of a message.

        Args:
            words: Fields of the message.
            at: Earliest first stamp moment, own clock without wraps.

        Returns:
            The frames; the stamp of the last one, own clock; the earliest stamp moment of the next
            message.
        """
        out = []
        parts = split(words.rows, self._params.phy.max_frame)
        stamp = at
        for p, rows in enumerate(parts):
            at = on_grid(at)
            stamp = at + self._params.antenna_delay
            frame = Frame(
                words.type, self._id, words.root, words.round, words.slot, words.n, self._boot,
                stamp % MODULUS, rows, self._params.pan, self._sequence, p, len(parts),
            )  # fmt: skip
            data = encode(frame)
            self._sequence = (self._sequence + 1) % 256
            out.append(Transmission(data, at % MODULUS))
            at += self._slots.frame(len(data)) + self._slots.gap
        return out, stamp, at
