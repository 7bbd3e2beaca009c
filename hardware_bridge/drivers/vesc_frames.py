"""Frames of the VESC on a UART, both directions.

    02 | length, 1 byte            | payload | CRC, 2 bytes | 03
    03 | length, 2 bytes, >= 255   | payload | CRC, 2 bytes | 03

Numbers are big-endian, the CRC is CRC-16/XMODEM of the payload, its first byte is the command [1].
The reader keeps a possible start of a frame until that frame is complete, damaged or invalid, like
the VESC's own reader; so a damaged length delays later frames by at most `LONGEST` bytes and loses
none of them.

References:
    [1] VESC firmware, comm/packet.c and comm/packet.h (longest payload 512 bytes).
        https://github.com/vedderb/bldc
"""

from __future__ import annotations

import re
from binascii import crc_hqx

from hardware_bridge.counts import Counts

GET_VALUES = 4
SET_RPM = 8
"""Payload: i32 electrical revolutions per minute."""
SET_CURRENT_BRAKE = 7
"""Payload: i32 [mA] brake current."""
SET_SERVO = 12
"""Payload: i16 [1/1000] from the shortest to the longest servo pulse."""

MOST_PAYLOAD = 512
"""[bytes] Largest payload of the firmware's default build."""
LONGEST = 3 + MOST_PAYLOAD + 3
"""[bytes] Length of the longest frame."""

_START = re.compile(rb"[\x02\x03]")
_STOP = 3


def frame(payload: bytes) -> bytes:
    """Return the frame of a payload of 1 to `MOST_PAYLOAD` bytes."""
    n = len(payload)
    head = bytes((2, n)) if n < 256 else b"\x03" + n.to_bytes(2, "big")
    return head + payload + crc_hqx(payload, 0).to_bytes(2, "big") + bytes((_STOP,))


class FrameReader:
    """Decoder of bytes, in pieces of any size, to payloads; keeps fewer than `LONGEST` bytes.

    It counts bytes and damaged frames; the caller interprets and counts payloads.
    """

    def __init__(self, counts: Counts) -> None:
        self._counts = counts
        self._data = bytearray()

    @property
    def waiting(self) -> int:
        """Number of bytes kept of an incomplete frame."""
        return len(self._data)

    def feed(self, data: bytes) -> list[bytes]:
        """Process received bytes and return the payloads that they complete, in order."""
        counts, buffer = self._counts, self._data
        counts.n_bytes += len(data)
        buffer += data
        payloads: list[bytes] = []
        at = 0
        while (start := _START.search(buffer, at)) is not None:
            counts.strange += start.start() - at
            at = start.start()
            span = _span(buffer, at)
            if span is None:
                break
            head, n = span
            end = at + head + n + 3
            if n and len(buffer) < end:
                break
            if n and _is_whole(buffer, at + head, n):
                payloads.append(bytes(buffer[at + head : at + head + n]))
                at = end
                continue
            # No frame begins here; one may begin at the very next byte.
            counts.damaged += bool(n)
            counts.strange += 1
            at += 1
        else:
            counts.strange += len(buffer) - at
            at = len(buffer)
        del buffer[:at]
        return payloads


def _span(buffer: bytearray, at: int) -> tuple[int, int] | None:
    """Return the lengths of head and payload of the frame that begins at an index.

    None if the head is incomplete; a payload of 0 if no frame can begin at the index.
    """
    head = buffer[at]
    if len(buffer) - at < head:
        return None
    if head == 2:
        return 2, buffer[at + 1]
    n = buffer[at + 1] << 8 | buffer[at + 2]
    return 3, n if 255 <= n <= MOST_PAYLOAD else 0


def _is_whole(buffer: bytearray, at: int, n: int) -> bool:
    """Return whether a payload is followed by its CRC and the end of a frame."""
    check = int.from_bytes(buffer[at + n : at + n + 2], "big")
    return buffer[at + n + 2] == _STOP and crc_hqx(bytes(buffer[at : at + n]), 0) == check
