"""Whole buffers of our wire format, to arrays of frames and values, and back."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from hardware_bridge.counts import Counts
from hardware_bridge.wire import _codec_kernels as kernels
from hardware_bridge.wire.definition import MOST_FRAME, MOST_ROWS
from hardware_bridge.wire.key import KEY_BYTES
from hardware_bridge.wire.layout import (
    COLUMN_TABLE,
    COLUMNS,
    CRC_TABLE,
    FRAME,
    MESSAGE_TABLE,
    Records,
)
from tracking.params.short_repr import short_repr

MOST_CODED = MOST_FRAME + 3
"""[bytes] Longest frame when it is stuffed, without the zero that ends it."""
_ROOM = MOST_FRAME + 8


@dataclass(slots=True)
class Batch:
    """Frames, and the values of all of them one below the other.

    Values stand in the order of `hardware_bridge.wire.definition`, in SI units (uT and dBm), a
    row for a message or for each row of a message that has rows; columns beyond are not written.
    """

    __repr__ = short_repr

    capacity: int = 256
    """Frames; for each there is room for four rows."""
    frames: Records = field(init=False)
    """(capacity) of `hardware_bridge.wire.layout.FRAME`."""
    values: NDArray[np.float64] = field(init=False)
    """(4 capacity + `MOST_ROWS`, column)"""
    n_frames: int = 0
    n_rows: int = 0

    def __post_init__(self) -> None:
        self.frames = np.zeros(self.capacity, FRAME)
        self.values = np.zeros((4 * self.capacity + MOST_ROWS, COLUMNS))


class Codec:
    """Of one key: what is decoded carries a right MAC, what is encoded carries one if it says so.

    Without a key MACs are not checked: a reader without one accepts every whole frame.
    """

    def __init__(self, key: bytes | None = None) -> None:
        """Take the key.

        Args:
            key: 16 bytes, or None.

        Raises:
            ValueError: It is not so long.
        """
        if key is not None and len(key) != KEY_BYTES:
            raise ValueError(f"key: expected {KEY_BYTES} bytes, got {len(key)}")
        self.keyed = key is not None
        self._key = np.frombuffer(key or bytes(KEY_BYTES), "<u8").astype(np.uint64)
        self._raw = np.zeros(_ROOM, np.uint8)
        self._state = np.zeros(6, np.int64)

    def decode(self, data: NDArray[np.uint8], start: int, batch: Batch, counts: Counts) -> int:
        """Decode as many whole frames as the batch has room for.

        Args:
            data: Bytes; a frame ends with a zero.
            start: Where to begin.
            batch: Filled from its beginning.
            counts: Added to, but for `n_bytes`.

        Returns:
            Where the next call begins; where it began if there is no whole frame any more.
        """
        state = self._state
        state[:] = (start, 0, 0, 0, 0, 0)
        kernels.decode_frames(
            data, self._key, self.keyed, CRC_TABLE, MESSAGE_TABLE, COLUMN_TABLE,
            self._raw, batch.frames, batch.values, state,
        )  # fmt: skip
        at, batch.n_frames, batch.n_rows, skipped, damaged, strange = state.tolist()
        counts.frames += batch.n_frames
        counts.skipped += skipped
        counts.damaged += damaged
        counts.strange += strange
        return int(at)

    def encode(self, batch: Batch) -> NDArray[np.uint8]:
        """The bytes of the frames of a batch, each between two zeros.

        Values that a number cannot hold become the nearest that it can.

        Raises:
            ValueError: A value is not finite, a type is unknown, a frame has too many rows, or
                one with MAC meets a codec without key.
        """
        frames, values = batch.frames[: batch.n_frames], batch.values[: batch.n_rows]
        messages = MESSAGE_TABLE[frames["type"]]
        if not messages["known"].all():
            raise ValueError("type: expected one of the definition")
        most = np.where(messages["repeated"], MOST_ROWS, 1)
        last = frames["first"].astype(np.int64) + frames["rows"]
        if ((frames["rows"] > most) | (frames["rows"] < 1 - messages["repeated"])).any():
            raise ValueError(f"rows: expected one, or up to {MOST_ROWS} of a message with rows")
        if (frames["first"] < 0).any() or (last > len(values)).any():
            raise ValueError("first: expected rows of the batch")
        if (frames["mac"] > self.keyed).any():
            raise ValueError("mac: expected no more than 1, and 0 without a key")
        out = np.empty(batch.n_frames * (_ROOM + 4), np.uint8)
        n = kernels.encode_frames(
            batch.frames, batch.n_frames, batch.values, self._key, CRC_TABLE, MESSAGE_TABLE,
            COLUMN_TABLE, self._raw, out,
        )  # fmt: skip
        if n < 0:
            raise ValueError("values: expected finite numbers")
        return out[:n]
