"""Keys of MACs in their text form."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from hardware_bridge.errors import BridgeError

KEY_BYTES = 16
REMOVED = "removed"
"""Text in place of a key in recordings."""
REMOVED_KEY = b"removed from rec"
"""Key in place of a removed one: messages are known to be signed, but MACs are not checked."""


def parse_key(text: str | None) -> bytes | None:
    """Return the key in hex digits; None for None.

    Raises:
        ValueError: The text is not a key; the message omits it, as it may be a mistyped secret.
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
    """Remove the keys of a configuration, so that it can be shared.

    Args:
        text: Content of a swarm.toml.
        keys: All keys in it.

    Raises:
        BridgeError: A key is written in a way that cannot be found in the text.
    """
    for key in keys:
        if key is not None and key != REMOVED_KEY:
            # Hex digits in upper or lower case, with or without space in between.
            digits = r"\s*".join(key.hex())
            text = re.sub(digits, REMOVED, text, flags=re.IGNORECASE)
    try:
        left = [name for name, written in _keys_in(tomllib.loads(text)) if written != REMOVED]
    except tomllib.TOMLDecodeError:
        left = ["key"]  # a key with an escape, partly removed
    if left:
        raise BridgeError(
            f"{left[0]}: cannot be kept out of the recording as it is written; "
            f"expected {2 * KEY_BYTES} hex digits on one line"
        )
    return text


def _keys_in(table: Mapping[str, Any], path: str = "") -> Iterator[tuple[str, object]]:
    """Yield all fields `key` of a table and its inner tables, by their full names."""
    for name, value in table.items():
        if isinstance(value, Mapping):
            yield from _keys_in(value, f"{path}{name}.")
        elif name == "key":
            yield f"{path}{name}", value


def read_key(text: str | None) -> bytes | None:
    """Return a key from hex digits, or from ``@`` and the name of a file that holds them.

    Arguments of commands are visible to every user of a machine, files need not be.

    Raises:
        ValueError: The file cannot be read, or the text is not a key.
    """
    if text is None or not text.startswith("@"):
        return parse_key(text)
    path = Path(text[1:])
    try:
        return parse_key(path.read_text(encoding="utf-8").strip())
    except (OSError, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: cannot be read ({error})") from error
