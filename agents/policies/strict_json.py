"""Strict parsing of untrusted JSON: finite numbers, unique keys, checked types."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from typing import Any, NoReturn

from agents.policies.errors import PolicyError


def parse_json(text: str | bytes, where: str) -> dict[str, Any]:
    """Return the object of a JSON text.

    Raises:
        PolicyError: Invalid JSON, a number that is not finite, or a duplicate key.
    """
    try:
        if isinstance(text, bytes):
            text = text.decode("utf-8")
        found = json.loads(
            text, object_pairs_hook=_once, parse_constant=_finite, parse_float=_finite
        )
    except (ValueError, RecursionError) as error:
        raise PolicyError(where, f"is no JSON: {ascii(str(error))[1:-1]}") from error
    if not isinstance(found, dict):
        raise PolicyError(where, f"expected an object, got {_kind(found)}")
    return found


class Reader:
    """Typed access to the values of an object; errors name the file and the key."""

    def __init__(self, values: dict[str, Any], where: str, *, inside: bool = False) -> None:
        """Store the object and its path.

        Args:
            values: Object.
            where: File; or, with `inside`, file and key, separated by a colon and a space.
            inside: True if the object is part of another.
        """
        self._values = values
        self._file, _, self._place = where.rpartition(": ") if inside else (where, "", "")

    def path(self, key: str) -> str:
        """Return file and key of a value."""
        return f"{self._file}: {self._name(key)}"

    def error(self, key: str, reason: str) -> PolicyError:
        """Return an error that names a value."""
        return PolicyError(self._file, f"{self._name(key)}: {reason}")

    def refuse(self, key: str, reason: str) -> NoReturn:
        """Raise an error that names a value."""
        raise self.error(key, reason)

    def has(self, key: str) -> None:
        """Check that a key exists."""
        if key not in self._values:
            self.refuse(key, "is missing")

    def keys(self, expected: tuple[str, ...]) -> None:
        """Check that exactly these keys exist."""
        for key in expected:
            self.has(key)
        for key in self._values:
            if key not in expected:
                self.refuse(f"{key[:60]!a}", f"unknown, expected {', '.join(expected)}")

    def text(self, key: str) -> str:
        """Return a string."""
        return self._of(key, str, "a string")  # type: ignore[no-any-return]

    def whole(self, key: str) -> int:
        """Return an integer."""
        return self._of(key, int, "a whole number")  # type: ignore[no-any-return]

    def number(self, key: str) -> float:
        """Return a number, as float; integers are permitted."""
        value = self._of(key, int | float, "a number")
        try:
            return float(value)
        except OverflowError:
            self.refuse(key, "expected a number, got one that is too large")

    def positive(self, key: str) -> float:
        """Return a number above 0."""
        value = self.number(key)
        if not value > 0.0:
            self.refuse(key, f"expected a number above 0, got {value:g}")
        return value

    def matching(self, key: str, pattern: re.Pattern[str], expected: str) -> str:
        """Return a string that matches a pattern."""
        value = self.text(key)
        if not pattern.fullmatch(value):
            self.refuse(key, f"expected {expected}, got {value[:80]!a}")
        return value

    def mapping(self, key: str) -> dict[str, Any]:
        """Return an object."""
        return self._of(key, dict, "an object")  # type: ignore[no-any-return]

    def mappings(self, key: str) -> list[dict[str, Any]]:
        """Return a list of objects."""
        values = self._of(key, list, "a list")
        for k, value in enumerate(values):
            if not isinstance(value, dict):
                self.refuse(f"{key}[{k}]", f"expected an object, got {_kind(value)}")
        return values  # type: ignore[no-any-return]

    def part(
        self, key: str, keys: tuple[str, ...], default: Mapping[str, Any] | None = None
    ) -> Reader:
        """Return a reader of an object with exactly these keys.

        Args:
            key: Key of the object.
            keys: Keys in the object.
            default: Values of keys that older files do not have.
        """
        reader = Reader({**(default or {}), **self.mapping(key)}, self.path(key), inside=True)
        reader.keys(keys)
        return reader

    def _of(self, key: str, kind: Any, expected: str) -> Any:
        value = self._values[key]
        # In Python a bool is an int, in a card it is not.
        if isinstance(value, bool) or not isinstance(value, kind):
            self.refuse(key, f"expected {expected}, got {_kind(value)}")
        return value

    def _name(self, key: str) -> str:
        return ".".join(part for part in (self._place, key) if part)


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        raise ValueError("a duplicate key")
    return found


def _finite(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(f"{text[:40]} is not finite")
    return value


def _kind(value: Any) -> str:
    """Return the JSON type of a value, or a scalar value, shortened."""
    names = {dict: "an object", list: "a list", type(None): "null"}
    name = names.get(type(value))
    if name is not None:
        return name
    shown = f"{value!a}" if not isinstance(value, int) or abs(value) < 10**20 else "a huge number"
    return {"True": "true", "False": "false"}.get(shown, shown)[:80]
