"""Codec of complete buffers of our wire format, to arrays of frames and values, and back."""

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
"""[bytes] Longest stuffed frame, without its final zero."""
_ROOM = MOST_FRAME + 8


@dataclass(slots=True)
class Batch:
    """Frames, and the values of all frames in consecutive rows.

    Values are in the order of `hardware_bridge.wire.definition`, in SI units (uT and dBm), one row
    per message or per row of a message with rows; unused columns are not written.
    """

    __repr__ = short_repr

    capacity: int = 256
    """Largest number of frames, with capacity for four rows each."""
    frames: Records = field(init=False)
    """Array (capacity) of `hardware_bridge.wire.layout.FRAME`."""
    values: NDArray[np.float64] = field(init=False)
    """Array (4 capacity + `MOST_ROWS`, column)."""
    n_frames: int = 0
    n_rows: int = 0

    def __post_init__(self) -> None:
        self.frames = np.zeros(self.capacity, FRAME)
        self.values = np.zeros((4 * self.capacity + MOST_ROWS, COLUMNS))


class Codec:
    """Codec with an optional key: decoding checks the MAC, encoding writes one if requested.

    Without a key MACs are not checked: every complete frame is accepted.
    """

    def __init__(self, key: bytes | None = None) -> None:
        """Create a codec.

        Args:
            key: Key of 16 bytes, or None.

        Raises:
            ValueError: The key does not have 16 bytes.
        """
        if key is not None and len(key) != KEY_BYTES:
            raise ValueError(f"key: expected {KEY_BYTES} bytes, got {len(key)}")
        self.keyed = key is not None
        self._key = np.frombuffer(key or bytes(KEY_BYTES), "<u8").astype(np.uint64)
        self._raw = np.zeros(_ROOM, np.uint8)
        self._state = np.zeros(6, np.int64)

    def decode(self, data: NDArray[np.uint8], start: int, batch: Batch, counts: Counts) -> int:
        """Decode as many complete frames as fit into the batch.

        Args:
            data: Bytes; a frame ends with a zero.
            start: Position of the first byte.
            batch: Output, filled from its beginning.
            counts: Counters to increment, except `n_bytes`.

        Returns:
            Start of the next call; equal to `start` if no complete frame is left.
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
        """Return the bytes of the frames of a batch, each between two zeros.

        Values out of range are clipped to the limits of their number.

        Raises:
            ValueError: A value is not finite, a type is unknown, a frame has too many rows, or a
                frame with MAC is given to a codec without key.
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
