"""Encoder of readings to the bytes that one of our nodes or cars would send."""

from __future__ import annotations

from hardware_bridge.readings import MICROSECONDS_32, Reading, Source
from hardware_bridge.wire.codec import Batch, Codec
from hardware_bridge.wire.conversion import NODE_LIMIT, WORD_LIMIT, message_of, word
from hardware_bridge.wire.definition import MOST_ROWS


class RelposEncoder:
    """Encoder for one boot of one device; see `hardware_bridge.decoders.base.Encoder`.

    Frames are numbered from 0. After 2^32 frames the boot increases by one, so that no pair of boot
    and sequence is repeated.
    """

    def __init__(self, node: int, boot: int, key: bytes | None = None) -> None:
        """Create an encoder for a device.

        Args:
            node: Node id, 0 to 65535; `hardware_bridge.wire.definition.HOST` commands cars.
            boot: Boot number, 0 to 2^32 - 1, different at each start; rising if a key is used.
            key: Key of 16 bytes: every frame carries a MAC.

        Raises:
            ValueError: An argument is invalid.
        """
        if not 0 <= node < NODE_LIMIT:
            raise ValueError(f"node: expected 0 to {NODE_LIMIT - 1}, got {node}")
        self.node = node
        self.boot = word("boot", boot)
        self.sequence = 0
        """Number of the next frame."""
        self._codec = Codec(key)
        self._batch = Batch()

    def encode(self, readings: list[Reading]) -> bytes:
        """Return the bytes of one instant of the device, in the order of the readings.

        Consecutive ranges with the same time share a frame. Sources must have a time, and only this
        is used; boot and sequence are the encoder's.

        Raises:
            ValueError: A reading has no time in microseconds, is of another device, or holds an
                invalid value; nothing was encoded, and no sequence number was used.
        """
        said = [(self._time(reading.source), *message_of(reading)) for reading in readings]
        out = bytearray()
        batch = self._batch
        batch.n_frames = batch.n_rows = 0
        before = None
        for time, message, values in said:
            if message.repeated and before == (time, message.type):
                frame = batch.frames[batch.n_frames - 1]
                if frame["rows"] < MOST_ROWS and batch.n_rows < len(batch.values):
                    self._add(values)
                    frame["rows"] += 1
                    continue
            if batch.n_frames == batch.capacity or batch.n_rows == len(batch.values):
                out += self._codec.encode(batch).tobytes()
                batch.n_frames = batch.n_rows = 0
            batch.frames[batch.n_frames] = (
                message.type, self._codec.keyed, self.node, self.boot, self.sequence, time,
                batch.n_rows, 1,
            )  # fmt: skip
            batch.n_frames += 1
            self._add(values)
            self._count()
            before = (time, message.type)
        out += self._codec.encode(batch).tobytes()
        return bytes(out)

    def _add(self, values: tuple[float, ...]) -> None:
        self._batch.values[self._batch.n_rows, : len(values)] = values
        self._batch.n_rows += 1

    def _count(self) -> None:
        self.sequence += 1
        if self.sequence == WORD_LIMIT:
            self.sequence = 0
            self.boot = (self.boot + 1) % WORD_LIMIT

    def _time(self, source: Source) -> int:
        if source.ticks is None:
            raise ValueError("source.ticks: expected a time [us], got None")
        if source.clock is not None and source.clock.hz != MICROSECONDS_32.hz:
            raise ValueError(f"source.clock: expected microseconds, got {source.clock}")
        if source.device is not None and source.device != str(self.node):
            raise ValueError(f"source.device: expected {self.node}, got {source.device!r}")
        return source.ticks % MICROSECONDS_32.modulus
