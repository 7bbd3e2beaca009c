"""Decoder of our own nodes and cars, see docs/reference/wire-format.md."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hardware_bridge.counts import Counts
from hardware_bridge.readings import MICROSECONDS_32, Reading, Source
from hardware_bridge.wire.codec import MOST_CODED, Batch, Codec
from hardware_bridge.wire.conversion import AS_READING, made, name_of
from hardware_bridge.wire.key import REMOVED_KEY


class RelposDecoder:
    """Decoder of frames to readings with device, boot, sequence and time of their frame.

    With a key, frames without a MAC or with a wrong one count as damaged. The receiver must detect
    replayed frames with a correct MAC, by boot and sequence.
    """

    def __init__(self, key: bytes | None = None) -> None:
        """Create a decoder.

        Args:
            key: 16 bytes; with None or `REMOVED_KEY` MACs are not checked.

        Raises:
            ValueError: The key does not have 16 bytes.
        """
        self.counts = Counts()
        self._codec = Codec(None if key == REMOVED_KEY else key)
        self._batch = Batch()
        self._kept = b""
        self._lost = False  # within a frame that was too long, until the next zero

    @property
    def waiting(self) -> int:
        """Number of bytes kept of an incomplete frame."""
        return len(self._kept)

    def feed(self, data: bytes) -> list[Reading]:
        """Process received bytes and return the readings that they complete, in order."""
        self.counts.n_bytes += len(data)
        if self._lost:
            zero = data.find(0)
            self.counts.strange += len(data) if zero < 0 else zero
            if zero < 0:
                return []
            self._lost, data = False, data[zero:]
        end = data.rfind(0) + 1
        readings = self._whole(self._kept + data[:end]) if end else []
        self._kept = data[end:] if end else self._kept + data
        if len(self._kept) > MOST_CODED:
            self.counts.strange += len(self._kept)
            self._kept, self._lost = b"", True
        return readings

    def _whole(self, data: bytes) -> list[Reading]:
        buffer: NDArray[np.uint8] = np.frombuffer(data, np.uint8)
        readings: list[Reading] = []
        at = 0
        while at < len(data):
            at = self._codec.decode(buffer, at, self._batch, self.counts)
            readings += self._read()
        return readings

    def _read(self) -> list[Reading]:
        batch = self._batch
        frames = batch.frames[: batch.n_frames].tolist()
        values = batch.values[: batch.n_rows].tolist()
        readings: list[Reading] = []
        for kind, _, node, boot, sequence, time, first, rows in frames:
            source = made(Source, (name_of(node), boot, sequence, time, MICROSECONDS_32))
            as_reading = AS_READING[kind]
            for row in values[first : first + rows]:
                reading = as_reading(source, row)
                if reading is None:
                    self.counts.frames -= 1
                    self.counts.damaged += 1
                else:
                    readings.append(reading)
        return readings
