"""Reading of frozen dataclasses from TOML tables by their fields and type hints.

Values are numbers, words, tuples, nested tables and lists of tables. Missing keys keep the value
of a base: another instance, or the one that a `Preset` key of the table names. An invalid entry
raises an error that names the file, the key and the allowed values.
"""

from __future__ import annotations

import math
import types
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING as REQUIRED
from dataclasses import dataclass, field, fields, is_dataclass, replace
from functools import lru_cache
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

from tracking.errors import ConfigError

T = TypeVar("T")
LARGEST = 1e12
"""Largest number accepted: no quantity here is so large."""


@dataclass(frozen=True, slots=True)
class Where:
    """A place in a file."""

    file: str
    path: str = ""
    raises: type[Exception] = ConfigError
    """Class of the errors about the file."""

    def key(self, name: str) -> Where:
        """Return the place of a key of this table."""
        return replace(self, path=f"{self.path}.{name}" if self.path else name)

    def item(self, k: int) -> Where:
        """Return the place of an entry of this list."""
        return replace(self, path=f"{self.path}[{k}]")

    def error(self, message: str) -> Exception:
        """Return an error about this place."""
        return self.raises(": ".join(part for part in (self.file, self.path, message) if part))


@dataclass(frozen=True, slots=True)
class Preset:
    """A key of a table that names the base of the rest, such as `place = "indoor"`."""

    key: str
    kind: type
    """Type of the value; `object` for any, which `find` checks."""
    find: Callable[[Any], Any]
    """Function from value to base; raises `Where.raises`."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TableReader:
    """Reader of tables; the presets are by the class of their table."""

    presets: Mapping[type, Preset] = field(default_factory=dict)

    def read(
        self,
        kind: type[T],
        table: object,
        where: Where,
        base: T | None = None,
        *,
        others: Sequence[str] = (),
    ) -> T:
        """Make an instance of a dataclass from a table.

        Args:
            kind: A frozen dataclass.
            table: Table of a TOML file.
            where: Place of the table, for messages.
            base: Source of missing values; None for the defaults of the class.
            others: Keys that another reader handles.

        Raises:
            ConfigError: Or `where.raises`; the message names the file and the key.
        """
        if not isinstance(table, dict):
            raise where.error(f"expected a table, got {_described(table)}")
        hints = readable(kind)  # type: ignore[arg-type]
        preset = self.presets.get(kind)
        expected = [*([preset.key] if preset else []), *hints, *others]
        for name in table:
            if name not in expected:
                shown = where.key(name if name.isprintable() and name else repr(name))
                raise shown.error(f"unknown, expected one of {', '.join(expected)}")
        if preset and preset.key in table:
            base = self._preset(preset, table[preset.key], where.key(preset.key))
        values = {
            name: self._value(hint, table[name], where.key(name), getattr(base, name, None))
            for name, hint in hints.items()
            if name in table
        }
        if base is None:
            for f in fields(kind):  # type: ignore[arg-type]
                needed = f.default is REQUIRED and f.default_factory is REQUIRED
                if needed and f.name not in values:
                    raise where.key(f.name).error("missing")
        try:
            return kind(**values) if base is None else replace(base, **values)  # type: ignore
        except (where.raises, ConfigError) as error:
            raise _placed(error, where, [f.name for f in fields(kind)]) from error  # type: ignore

    def _preset(self, preset: Preset, value: object, where: Where) -> Any:
        selected = value if preset.kind is object else self._value(preset.kind, value, where, None)
        try:
            return preset.find(selected)
        except where.raises as error:
            raise where.error(str(error).removeprefix(f"{preset.key}: ")) from error

    def _value(self, hint: Any, value: object, where: Where, base: Any) -> Any:
        """Return one value of a type."""
        origin = get_origin(hint)
        if origin in (Union, types.UnionType):
            (hint,) = (a for a in get_args(hint) if a is not type(None))
            return self._value(hint, value, where, base)
        if origin is Literal:
            if value not in get_args(hint) or not isinstance(value, str):
                names = ", ".join(map(repr, get_args(hint)))
                raise where.error(f"expected one of {names}, got {_described(value)}")
            return value
        if origin is tuple:
            return self._tuple(get_args(hint), value, where)
        if is_dataclass(hint):
            return self.read(hint, value, where, base)  # type: ignore[arg-type]
        return _scalar(hint, value, where)

    def _tuple(self, items: tuple[Any, ...], value: object, where: Where) -> tuple[Any, ...]:
        """Return a list of a fixed length, or of any length if the type ends in dots."""
        if not isinstance(value, list):
            raise where.error(f"expected a list, got {_described(value)}")
        if items[-1] is Ellipsis:
            items = (items[0],) * len(value)
        if len(items) != len(value):
            raise where.error(f"expected {len(items)} values, got {len(value)}")
        return tuple(
            self._value(hint, v, where.item(k), None)
            for k, (hint, v) in enumerate(zip(items, value, strict=True))
        )


@lru_cache(maxsize=256)
def readable(kind: type) -> dict[str, Any]:
    """Return the fields of a dataclass that a file may set, and their types."""
    hints = get_type_hints(kind)
    return {f.name: hints[f.name] for f in fields(kind) if f.metadata.get("in_file", True)}


def _scalar(hint: Any, value: object, where: Where) -> Any:
    """Return a number or a word; booleans and NaN are not numbers."""
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if hint is float and number:
        finite = isinstance(value, int) or math.isfinite(value)  # type: ignore[arg-type]
        if finite and abs(value) <= LARGEST:  # type: ignore[arg-type]
            return float(value)  # type: ignore[arg-type]
        within = f"a number within {LARGEST:g}" if finite else "a finite number"
        raise where.error(f"expected {within}, got {_described(value)}")
    if hint is int and number and isinstance(value, int):
        if abs(value) <= LARGEST:
            return value
        raise where.error(f"expected a number within {LARGEST:g}, got {_described(value)}")
    if (hint is bool and isinstance(value, bool)) or (hint is str and isinstance(value, str)):
        return value
    expected = {float: "a number", int: "a whole number", bool: "true or false", str: "a string"}
    raise where.error(f"expected {expected[hint]}, got {_described(value)}")


def _described(value: object) -> str:
    """Return a short form of a value as written in the file."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, dict):
        return "a table"
    if isinstance(value, list):
        return "a list"
    if isinstance(value, int) and abs(value) > LARGEST:
        return "a number too large"
    text = repr(value) if isinstance(value, (str, int, float)) else str(value)
    return text if len(text) <= 40 else f"{text[:37]}..."


def _placed(error: Exception, where: Where, names: list[str]) -> Exception:
    """Return an error of a class with its place; its message may begin with a field."""
    message = str(error)
    head = message.split(":", 1)[0]
    if where.path and head.split(".")[0].split("[")[0] in names:
        return where.raises(f"{where.file}: {where.path}.{message}")
    return where.error(message)
