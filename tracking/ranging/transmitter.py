"""Conversion of messages to frames with exact times, split if one frame is too short."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from tracking.ranging.events import Transmission
from tracking.ranging.frames.motion import AGE_UNIT, Motion, encode_motion
from tracking.ranging.frames.slots import Slots
from tracking.ranging.frames.timestamps import MODULUS, TICK_HZ, difference, on_grid
from tracking.ranging.frames.wire import (
    MAX_PARTS,
    Entry,
    Frame,
    Type,
    encode,
    split,
)
from tracking.ranging.params import SessionParams


@dataclass(frozen=True, slots=True)
class Message:
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
        self.room = MAX_PARTS * params.phy.room
        """Number of rows that a message can have."""
        self._motion: tuple[Motion, int] | None = None

    def set_motion(self, motion: Motion | None, at: int) -> None:
        """Set the motion that the next messages carry, if `Phy.motion_bytes` has room for it.

        Args:
            motion: Sums at the last inertial sample; the age is set when a message is sent. None
                if the orientation is unknown.
            at: Time of the sample, own clock, 40-bit stamp.
        """
        self._motion = None if motion is None else (motion, at)

    def send(self, message: Message, at: int) -> tuple[list[Transmission], int, int]:
        """Build the frames of a message.

        Args:
            message: Fields of the message.
            at: Earliest first stamp moment, own clock without wraps.

        Returns:
            The frames; the stamp of the last one, own clock; the earliest stamp moment of the next
            message.
        """
        out = []
        phy = self._params.phy
        parts = split(message.rows, phy.max_frame - phy.motion_bytes)
        stamp = at
        for p, rows in enumerate(parts):
            at = on_grid(at)
            stamp = at + self._params.antenna_delay
            frame = Frame(
                message.type, self._id, message.root, message.round, message.slot, message.n,
                self._boot, stamp % MODULUS, rows, self._params.pan, self._sequence, p, len(parts),
                self._motion_at(stamp) if rows and p + 1 == len(parts) else b"",
            )  # fmt: skip
            data = encode(frame)
            self._sequence = (self._sequence + 1) % 256
            out.append(Transmission(data, at % MODULUS))
            at += self._slots.frame(len(data)) + self._slots.gap
        return out, stamp, at

    def _motion_at(self, stamp: int) -> bytes:
        """Return the bytes of the motion for a message; none if it is unknown or too old."""
        if self._motion is None or not self._params.phy.motion_bytes:
            return b""
        motion, at = self._motion
        age = round(difference(stamp % MODULUS, at) / TICK_HZ / AGE_UNIT)
        return encode_motion(replace(motion, age=age)) if 0 <= age < 1 << 16 else b""
