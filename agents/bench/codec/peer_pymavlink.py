"""Peer: MAVLink 2 in Python, a similar format, with the parser of pymavlink."""

from __future__ import annotations

from typing import Any

from agents.errors import UsageError

CHUNK = 1024
"""[bytes] Size of the chunks read from a port."""


class Mavlink:
    """IMU messages, `RAW_IMU`."""

    def __init__(self, n: int) -> None:
        """Create `n` messages, and check that all of them are decoded.

        Raises:
            UsageError: pymavlink is not installed.
        """
        try:
            import pymavlink
            from pymavlink.dialects.v20 import common
        except ImportError:
            raise UsageError(
                "bench: pymavlink is not installed, expected the development tools: "
                ".venv/bin/pip install -e '.[dev]' -c constraints.txt"
            ) from None
        self.name = f"pymavlink {pymavlink.__version__}"
        self._common: Any = common
        self._sender = common.MAVLink(None, 1, 1)
        self._messages = [
            common.MAVLink_raw_imu_message(10_000 * k, *_numbers(k), 0, 20) for k in range(n)
        ]
        data = self.encode()
        self._chunks = [data[at : at + CHUNK] for at in range(0, len(data), CHUNK)]
        if self.decode() != n:
            raise AssertionError("pymavlink gives fewer messages than went in")

    def encode(self) -> bytes:
        """Encode the messages to bytes."""
        return b"".join(message.pack(self._sender) for message in self._messages)

    def decode(self) -> int:
        """Decode the bytes; return the number of messages."""
        parser, n = self._common.MAVLink(None), 0
        for chunk in self._chunks:
            n += len(parser.parse_buffer(chunk) or ())
        return n


def _numbers(k: int) -> list[int]:
    """Return nine 16-bit numbers."""
    return [(7919 * (9 * k + j)) % 65536 - 32768 for j in range(9)]
