"""JSON of other origin: finite numbers, no key twice, every type checked and named."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from typing import Any, NoReturn

from agents.policies.errors import PolicyError


def parse_json(text: str | bytes, where: str) -> dict[str, Any]:
    """The object that a text holds.

    Raises:
        PolicyError: It is no JSON, holds a number that is not finite, or a key twice.
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
    """Takes values out of an object and says where one is wrong."""

    def __init__(self, values: dict[str, Any], where: str, *, inside: bool = False) -> None:
        """Read from an object.

        Args:
            values: The object.
            where: The file; or, with `inside`, file and place, separated by a colon and a space.
            inside: Whether it is a part of another.
        """
        self._values = values
        self._file, _, self._place = where.rpartition(": ") if inside else (where, "", "")

    def path(self, key: str) -> str:
        """File and place of a value."""
        return f"{self._file}: {self._name(key)}"

    def error(self, key: str, reason: str) -> PolicyError:
        """The error that names a value."""
        return PolicyError(self._file, f"{self._name(key)}: {reason}")

    def refuse(self, key: str, reason: str) -> NoReturn:
        """Raise it."""
        raise self.error(key, reason)

    def has(self, key: str) -> None:
        """See that a key is there."""
        if key not in self._values:
            self.refuse(key, "is missing")

    def keys(self, expected: tuple[str, ...]) -> None:
        """See that exactly these keys are there."""
        for key in expected:
            self.has(key)
        for key in self._values:
            if key not in expected:
                self.refuse(f"{key[:60]!a}", f"unknown, expected {', '.join(expected)}")

    def text(self, key: str) -> str:
        """A string."""
        return self._of(key, str, "a string")  # type: ignore[no-any-return]

    def whole(self, key: str) -> int:
        """A whole number."""
        return self._of(key, int, "a whole number")  # type: ignore[no-any-return]

    def number(self, key: str) -> float:
        """A number; whole ones too."""
        value = self._of(key, int | float, "a number")
        try:
            return float(value)
        except OverflowError:
            self.refuse(key, "expected a number, got one that is too large")

    def positive(self, key: str) -> float:
        """A number above 0."""
        value = self.number(key)
        if not value > 0.0:
            self.refuse(key, f"expected a number above 0, got {value:g}")
        return value

    def matching(self, key: str, pattern: re.Pattern[str], expected: str) -> str:
        """A string of a certain form."""
        value = self.text(key)
        if not pattern.fullmatch(value):
            self.refuse(key, f"expected {expected}, got {value[:80]!a}")
        return value

    def mapping(self, key: str) -> dict[str, Any]:
        """An object."""
        return self._of(key, dict, "an object")  # type: ignore[no-any-return]

    def mappings(self, key: str) -> list[dict[str, Any]]:
        """A list of objects."""
        values = self._of(key, list, "a list")
        for k, value in enumerate(values):
            if not isinstance(value, dict):
                self.refuse(f"{key}[{k}]", f"expected an object, got {_kind(value)}")
        return values  # type: ignore[no-any-return]

    def part(
        self, key: str, keys: tuple[str, ...], default: Mapping[str, Any] | None = None
    ) -> Reader:
        """An object with exactly these keys.

        Args:
            key: Of the object.
            keys: In it.
            default: Values of those that older files do not have.
        """
        reader = Reader({**(default or {}), **self.mapping(key)}, self.path(key), inside=True)
        reader.keys(keys)
        return reader

    def _of(self, key: str, kind: Any, expected: str) -> Any:
        value = self._values[key]
        # A bool is an int to Python, but not to the reader of a card.
        if isinstance(value, bool) or not isinstance(value, kind):
            self.refuse(key, f"expected {expected}, got {_kind(value)}")
        return value

    def _name(self, key: str) -> str:
        return ".".join(part for part in (self._place, key) if part)


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        raise ValueError("a key stands there twice")
    return found


def _finite(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(f"{text[:40]} is not finite")
    return value


def _kind(value: Any) -> str:
    """What it is, as JSON calls it, and the value where that is short."""
    names = {dict: "an object", list: "a list", type(None): "null"}
    name = names.get(type(value))
    if name is not None:
        return name
    shown = f"{value!a}" if not isinstance(value, int) or abs(value) < 10**20 else "a huge number"
    return {"True": "true", "False": "false"}.get(shown, shown)[:80]
