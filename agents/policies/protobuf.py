"""Parser of the protocol buffers wire format, as far as needed to validate a file.

A message is a sequence of fields, each a tag (number * 8 + wire type) and a value [1]. All fields
are returned, including duplicates, of which other parsers take the last or merge them: a file
cannot show one value to this check and another to onnxruntime.

References:
    [1] Protocol Buffers documentation, Encoding, https://protobuf.dev/programming-guides/encoding
"""

from __future__ import annotations

from collections.abc import Iterator

VARINT, FIXED64, BYTES, FIXED32 = 0, 1, 2, 5
"""Wire types; the two deprecated group types are refused."""


class WireError(Exception):
    """The bytes are not a valid sequence of fields."""


class Budget:
    """Limit of the number of fields in a file, over all levels of nesting."""

    def __init__(self, fields: int) -> None:
        self.left = fields

    def spend(self) -> None:
        """Count one field."""
        self.left -= 1
        if self.left < 0:
            raise WireError("too many parts")


def fields(message: memoryview, budget: Budget) -> Iterator[tuple[int, int, int | memoryview]]:
    """Yield number, wire type and value of every field of a message, in order.

    The value is an int for a varint, else the bytes.

    Args:
        message: Bytes of the message.
        budget: Remaining number of fields.

    Raises:
        WireError: The bytes are not a message, or there are too many fields.
    """
    at = 0
    while at < len(message):
        budget.spend()
        tag, at = _varint(message, at, 5)
        number, wire = tag >> 3, tag & 7
        if number == 0 or number >= 1 << 29:
            raise WireError("a field of an impossible number")
        if wire == VARINT:
            value, at = _varint(message, at, 10)
            yield number, wire, value
            continue
        if wire == BYTES:
            length, at = _varint(message, at, 10)
        elif wire in (FIXED64, FIXED32):
            length = 8 if wire == FIXED64 else 4
        else:
            raise WireError(f"a field of wire type {wire}")
        if length > len(message) - at:
            raise WireError("it ends within a field")
        yield number, wire, message[at : at + length]
        at += length


def _varint(message: memoryview, at: int, most: int) -> tuple[int, int]:
    """Return a number of seven bits per byte, the lowest first, and its end."""
    value = 0
    for k in range(most):
        if at + k >= len(message):
            raise WireError("it ends within a number")
        byte = message[at + k]
        value |= (byte & 0x7F) << (7 * k)
        if byte < 0x80:
            return value, at + k + 1
    raise WireError("a number that is too long")
