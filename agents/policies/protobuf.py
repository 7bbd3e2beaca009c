"""The wire format of protocol buffers, read as far as it takes to see what a file is made of.

A message is a row of fields, each a tag (number * 8 + wire type) and a value [1]. Every field that
is there is given, also repeated ones, of which other readers take the last or join them: a reader
that looks at all of them cannot be deceived.

References:
    [1] Protocol Buffers documentation, Encoding, https://protobuf.dev/programming-guides/encoding
"""

from __future__ import annotations

from collections.abc import Iterator

VARINT, FIXED64, BYTES, FIXED32 = 0, 1, 2, 5
"""Wire types; the two of the old groups are refused."""


class WireError(Exception):
    """Not a row of fields."""


class Budget:
    """So many fields may be read of a file, however they are nested."""

    def __init__(self, fields: int) -> None:
        self.left = fields

    def spend(self) -> None:
        """Read one more."""
        self.left -= 1
        if self.left < 0:
            raise WireError("too many parts")


def fields(message: memoryview, budget: Budget) -> Iterator[tuple[int, int, int | memoryview]]:
    """Number, wire type and value of every field of a message, in order.

    The value is an int of a varint, else the bytes.

    Args:
        message: Its bytes.
        budget: What may still be read.

    Raises:
        WireError: It is no message, or has too many fields.
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
    """A number of seven bits a byte, the lowest first, and where it ends."""
    value = 0
    for k in range(most):
        if at + k >= len(message):
            raise WireError("it ends within a number")
        byte = message[at + k]
        value |= (byte & 0x7F) << (7 * k)
        if byte < 0x80:
            return value, at + k + 1
    raise WireError("a number that is too long")
