"""The key of a MAC, as people write it."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from hardware_bridge.errors import BridgeError

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

    Raises:
        BridgeError: A key is written so that it cannot be found in the text.
    """
    for key in keys:
        if key is not None and key != REMOVED_KEY:
            # Hex digits as people write them: in any case, with or without space between.
            digits = r"\s*".join(key.hex())
            text = re.sub(digits, REMOVED, text, flags=re.IGNORECASE)
    try:
        left = [name for name, written in _keys_in(tomllib.loads(text)) if written != REMOVED]
    except tomllib.TOMLDecodeError:
        left = ["key"]  # one with an escape, of which a part was removed
    if left:
        raise BridgeError(
            f"{left[0]}: cannot be kept out of the recording as it is written; "
            f"expected {2 * KEY_BYTES} hex digits on one line"
        )
    return text


def _keys_in(table: Mapping[str, Any], path: str = "") -> Iterator[tuple[str, object]]:
    """All fields `key` of a table and of those in it, by their full names."""
    for name, value in table.items():
        if isinstance(value, Mapping):
            yield from _keys_in(value, f"{path}{name}.")
        elif name == "key":
            yield f"{path}{name}", value


def read_key(text: str | None) -> bytes | None:
    """The key that a person gives: hex digits, or ``@`` and the name of a file that holds them.

    Arguments of commands can be seen by everybody on a machine, files need not.

    Raises:
        ValueError: There is no such file, or it holds no key.
    """
    if text is None or not text.startswith("@"):
        return parse_key(text)
    path = Path(text[1:])
    try:
        return parse_key(path.read_text(encoding="utf-8").strip())
    except (OSError, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: cannot be read ({error})") from error
