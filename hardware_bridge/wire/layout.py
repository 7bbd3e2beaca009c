"""Definition of the wire format as tables for kernels."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from hardware_bridge.wire.definition import MESSAGES

Records: TypeAlias = NDArray[Any]

FRAME = np.dtype(
    [
        ("type", np.uint8),
        ("mac", np.uint8),  # 1 if the frame carries a MAC
        ("node", np.uint16),
        ("boot", np.uint32),
        ("sequence", np.uint32),
        ("time", np.uint32),  # [us]
        ("first", np.int32),  # first row of values
        ("rows", np.int32),  # number of rows
    ]
)
"""Metadata of a frame."""

_MESSAGE = np.dtype(
    [
        ("known", np.uint8),
        ("repeated", np.uint8),
        ("first", np.int32),  # first column
        ("columns", np.int32),
        ("size", np.int32),  # [bytes] size of a row
    ]
)
_COLUMN = np.dtype(
    [
        ("size", np.int32),
        ("signed", np.uint8),
        ("steps", np.float64),
        ("low", np.float64),
        ("high", np.float64),
    ]
)

COLUMNS = max(message.columns for message in MESSAGES)
"""Number of columns of an array of values."""


def _tables() -> tuple[Records, Records]:
    messages = np.zeros(256, _MESSAGE)
    columns: list[tuple[int, bool, float, int, int]] = []
    for message in MESSAGES:
        row = (True, message.repeated, len(columns), message.columns, message.size)
        messages[message.type] = row
        for field in message.fields:
            signed = field.type[0] == "i"
            columns += [(field.size, signed, field.steps, *field.limits)] * field.n
    return messages, np.array(columns, _COLUMN)


MESSAGE_TABLE, COLUMN_TABLE = _tables()
"""Tables by type of message, and by column of all messages in sequence."""


def _crc_table() -> NDArray[np.uint32]:
    """Return remainders of a byte, and of it and k zero bytes, by 0xEDB88320, (8, 256)."""
    table = np.zeros((8, 256), np.uint32)
    for byte in range(256):
        value = byte
        for _ in range(8):
            value = value >> 1 ^ (0xEDB88320 if value & 1 else 0)
        table[0, byte] = value
    for k in range(1, 8):
        for byte in range(256):
            value = int(table[k - 1, byte])
            table[k, byte] = value >> 8 ^ int(table[0, value & 0xFF])
    return table


CRC_TABLE = _crc_table()
