"""The key of a MAC, as people write it."""

from __future__ import annotations

import re
from collections.abc import Iterable

KEY_BYTES = 16
REMOVED = "removed"
"""Stands in recordings in place of a key."""
REMOVED_KEY = b"removed from rec"
"""That a message was signed is known where this is the key, and not whether rightly."""


def parse_key(text: str | None) -> bytes | None:
    """The key that hex digits are; None is none.

    Raises:
        ValueError: They are no key. What may be a secret with a slip in it is not in the message.
    """
    if text is None:
        return None
    if text == REMOVED:
        return REMOVED_KEY
    try:
        key = bytes.fromhex(text)
    except ValueError:
        key = b""
    if len(key) != KEY_BYTES:
        raise ValueError(f"expected {KEY_BYTES} bytes as {2 * KEY_BYTES} hex digits")
    return key


def without_keys(text: str, keys: Iterable[bytes | None]) -> str:
    """A configuration whose keys are removed, so that it can be shared.

    Args:
        text: Of a swarm.toml.
        keys: All that are in it.
    """
    for key in keys:
        if key is not None and key != REMOVED_KEY:
            # Hex digits as people write them: in any case, with or without space between.
            digits = r"\s*".join(key.hex())
            text = re.sub(digits, REMOVED, text, flags=re.IGNORECASE)
    return text
