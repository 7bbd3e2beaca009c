"""Options of a driver: conversion of a configuration table to the driver's dataclass.

An options class is a frozen dataclass of numbers, booleans, strings and lists of numbers. It checks
the range of numbers at construction, with `expect`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, fields
from math import isfinite
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

from hardware_bridge.errors import BridgeError

T = TypeVar("T")


def expect(is_right: bool, name: str, expected: str, value: object) -> None:
    """Refuse a value of a field that is not right.

    Raises:
        BridgeError: ``name: expected ..., got ...``
    """
    if not is_right:
        raise BridgeError(f"{name}: expected {expected}, got {value!r}")


def read_options(cls: type[T], given: Mapping[str, object], where: str) -> T:
    """Return an options dataclass from a parsed TOML table.

    Args:
        cls: The dataclass; its annotations define the types.
        given: Field name to value; fields that are left out keep their defaults.
        where: Name of the table in the configuration, ``cars.1.options``.

    Raises:
        BridgeError: An unknown or missing name, a wrong type or a number out of range.
    """
    hints = get_type_hints(cls)
    names = [f.name for f in fields(cls)]  # type: ignore[arg-type]
    values: dict[str, Any] = {}
    for name, value in given.items():
        if name not in names:
            raise BridgeError(f"{where}.{name}: expected one of {', '.join(names)}")
        try:
            values[name] = _convert(value, hints[name])
        except ValueError as error:
            raise BridgeError(f"{where}.{name}: expected {error}, got {value!r}") from None
    for f in fields(cls):  # type: ignore[arg-type]
        if f.name not in values and f.default is MISSING and f.default_factory is MISSING:
            raise BridgeError(f"{where}.{f.name}: expected a value, it has no default")
    try:
        return cls(**values)
    except BridgeError as error:
        raise BridgeError(f"{where}.{error}") from None


def _convert(value: Any, hint: Any) -> Any:
    """Return a TOML value as a field's type; a ValueError names the expected type."""
    if get_origin(hint) is tuple:
        return _convert_list(value, get_args(hint))
    if hint is bool:
        if not isinstance(value, bool):
            raise ValueError("true or false")
        return value
    if hint is str:
        if not isinstance(value, str):
            raise ValueError("a text")
        return value
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError("a number" if hint is float else "a whole number")
    if not isfinite(value):
        raise ValueError("a finite number")
    if hint is int and value != int(value):
        raise ValueError("a whole number")
    return hint(value)


def _convert_list(value: Any, items: tuple[Any, ...]) -> tuple[Any, ...]:
    """Return a TOML list as a tuple: of any length for ``tuple[X, ...]``, else of that length."""
    if not isinstance(value, list | tuple):
        raise ValueError("a list")
    if items[-1] is Ellipsis:
        return tuple(_convert(item, items[0]) for item in value)
    if len(value) != len(items):
        raise ValueError(f"lists of {len(items)}")
    return tuple(_convert(item, hint) for item, hint in zip(value, items, strict=True))
