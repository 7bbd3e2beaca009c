"""What nodes send, in our format."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hardware_bridge.counts import Counts
from hardware_bridge.wire.codec import Batch, Codec
from hardware_bridge.wire.definition import IMU, RANGES, Message

OTHERS = 5
"""[-] Nodes that a message of ranges is about."""
IMU_PER_RANGES = 10
"""[-] In the mixture: 100 samples and 10 rounds a second."""
KEY = bytes(range(16))


def imu(k: int) -> Message:
    """Samples of an inertial sensor only."""
    return IMU


def ranges(k: int) -> Message:
    """Ranges only."""
    return RANGES


def mixture(k: int) -> Message:
    """What a node sends that ranges and has an inertial sensor."""
    return RANGES if k % (IMU_PER_RANGES + 1) == IMU_PER_RANGES else IMU


class Stream:
    """So many frames: as arrays, and as bytes."""

    def __init__(self, messages: list[Message], *, key: bytes | None, seed: int = 0) -> None:
        """Draw values and encode them.

        Args:
            messages: Of the frames.
            key: Frames carry a MAC.
            seed: Of the values.
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
        """Arrays to bytes."""
        return self.codec.encode(self.sent)

    def decode(self) -> None:
        """Bytes to arrays."""
        self.codec.decode(self.data, 0, self.got, Counts())
