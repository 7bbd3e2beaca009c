"""The key of a MAC, as people write it."""

from __future__ import annotations

KEY_BYTES = 16


def parse_key(text: str | None) -> bytes | None:
    """The key that hex digits are; None is none.

    Raises:
        ValueError: They are no key. What may be a secret with a slip in it is not in the message.
    """
    if text is None:
        return None
    try:
        key = bytes.fromhex(text)
    except ValueError:
        key = b""
    if len(key) != KEY_BYTES:
        raise ValueError(f"expected {KEY_BYTES} bytes as {2 * KEY_BYTES} hex digits")
    return key
