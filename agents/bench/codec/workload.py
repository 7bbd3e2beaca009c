"""Frames of nodes in our wire format."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hardware_bridge.counts import Counts
from hardware_bridge.wire.codec import Batch, Codec
from hardware_bridge.wire.definition import IMU, RANGES, Message

OTHERS = 5
"""[-] Ranges per message."""
IMU_PER_RANGES = 10
"""[-] IMU samples per range message in the mixture: 100 Hz samples and 10 Hz rounds."""
KEY = bytes(range(16))


def imu(k: int) -> Message:
    """Return the message type of frame k: IMU samples only."""
    return IMU


def ranges(k: int) -> Message:
    """Return the message type of frame k: ranges only."""
    return RANGES


def mixture(k: int) -> Message:
    """Return the message type of frame k of a node with ranges and an IMU."""
    return RANGES if k % (IMU_PER_RANGES + 1) == IMU_PER_RANGES else IMU


class Stream:
    """Frames as arrays and as bytes."""

    def __init__(self, messages: list[Message], *, key: bytes | None, seed: int = 0) -> None:
        """Sample random values and encode them.

        Args:
            messages: Message types of the frames.
            key: Key of the MACs; None sends frames without MAC.
            seed: Seed of the values.
        """
        rng = np.random.default_rng(seed)
        self.n = len(messages)
        self.codec = Codec(key)
        self.key = key
        self.sent, self.got = Batch(self.n * 2), Batch(self.n * 2)
        for k, message in enumerate(messages):
            rows = OTHERS if message.repeated else 1
            at = self.sent.n_rows
            self.sent.frames[k] = (
                message.type, key is not None, 3, 1, k, 10_000 * k, at, rows,
            )  # fmt: skip
            low, high = np.array(
                [field.limits for field in message.fields for _ in range(field.n)]
            ).T
            steps = np.array([field.steps for field in message.fields for _ in range(field.n)])
            drawn = rng.integers(low, high, (rows, message.columns), endpoint=True)
            self.sent.values[at : at + rows, : message.columns] = drawn / steps
            self.sent.n_rows += rows
        self.sent.n_frames = self.n
        self.data: NDArray[np.uint8] = np.frombuffer(self.encode().tobytes(), np.uint8)
        self.decode()
        n_rows = self.sent.n_rows
        ours, theirs = self.sent.values[:n_rows], self.got.values[:n_rows]
        if self.got.n_frames != self.n or not np.array_equal(ours, theirs):
            raise AssertionError("the codec gives other frames than went in")

    def encode(self) -> NDArray[np.uint8]:
        """Encode the arrays to bytes."""
        return self.codec.encode(self.sent)

    def decode(self) -> None:
        """Decode the bytes to arrays."""
        self.codec.decode(self.data, 0, self.got, Counts())
