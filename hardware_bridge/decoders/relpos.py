"""Our own nodes and cars: see docs/reference/wire-format.md."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hardware_bridge.counts import Counts
from hardware_bridge.readings import MICROSECONDS_32, Reading, Source
from hardware_bridge.wire.codec import MOST_CODED, Batch, Codec
from hardware_bridge.wire.conversion import AS_READING, made, name_of
from hardware_bridge.wire.key import REMOVED_KEY


class RelposDecoder:
    """Frames to readings, each with device, boot, sequence and time of its frame.

    With a key, frames without a MAC or with a wrong one are damaged. That a frame with a right MAC
    was not seen before is for the receiver to check, by boot and sequence.
    """

    def __init__(self, key: bytes | None = None) -> None:
        """Take the key.

        Args:
            key: 16 bytes; None and `REMOVED_KEY`: MACs are not checked.

        Raises:
            ValueError: It is not so long.
        """
        self.counts = Counts()
        self._codec = Codec(None if key == REMOVED_KEY else key)
        self._batch = Batch()
        self._kept = b""
        self._lost = False  # in a frame that was too long, up to the next zero

    @property
    def waiting(self) -> int:
        """Bytes kept of a frame that is not complete."""
        return len(self._kept)

    def feed(self, data: bytes) -> list[Reading]:
        """Take bytes as they come and return what they complete, in order."""
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
