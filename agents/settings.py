"""Frozen dataclasses as command-line options and as JSON, both derived from the fields.

A settings class has fields that are numbers, strings, choices (`Literal`), tuples of numbers or
strings, or nested settings classes. The docstring below a field is its help; its metadata may
hold the smallest and the largest value, see `number`. Names are unique over all nested classes, so
that options need no prefix.
"""

from __future__ import annotations

import ast
import inspect
import textwrap
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import MISSING, asdict, field, fields, is_dataclass
from typing import Any, Literal, TypeVar, get_args, get_origin, get_type_hints

import click

from agents.errors import UsageError

T = TypeVar("T")


def number(default: float, low: float, high: float) -> Any:
    """Return a field for a number in a closed range."""
    return field(default=default, metadata={"low": low, "high": high})


def options(cls: type) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Decorate a command with an option for every leaf; options of lists are repeatable."""

    def decorate(command: Callable[..., Any]) -> Callable[..., Any]:
        for leaf in reversed(list(leaves(cls))):
            default = leaf.default
            shown = ",".join(map(str, default)) if isinstance(default, tuple) else default
            repeats = " Repeatable." if leaf.many else ""
            option = click.option(
                leaf.option,
                leaf.name,
                default=None,
                type=str,
                multiple=leaf.many,
                metavar=leaf.metavar,
                help=f"{leaf.help}{repeats} [default: {shown if shown != '' else 'none'}]",
            )
            command = option(command)
        return command

    return decorate


Given = Mapping[str, str | Sequence[str] | None]
"""Text of each option by leaf name: one, several if repeated, or None if not given."""


def is_given(text: str | Sequence[str] | None) -> bool:
    """Return whether an option was given."""
    return text is not None and (isinstance(text, str) or len(text) > 0)


def from_options(cls: type[T], given: Given, base: T | None = None) -> T:
    """Return settings from texts by leaf name; other values are those of `base` or the defaults.

    Raises:
        UsageError: A text is invalid or out of range; the message names the option.
    """
    texts = {k: v for k, v in given.items() if v is not None and is_given(v)}

    def value(leaf: Leaf, old: Any) -> Any:
        return _parse(leaf, texts[leaf.name]) if leaf.name in texts else old

    start: Any = cls() if base is None else base
    built: T = _map(cls, asdict(start), value)
    return built


def as_options(settings: Any) -> list[str]:
    """Return the command-line arguments of all settings that differ from their defaults."""
    values = dict(_values(settings))
    words = []
    for leaf in leaves(type(settings)):
        value = values[leaf.name]
        if value != leaf.default:
            # An empty text gives an empty list.
            for one in (value or ("",)) if leaf.many else (value,):
                words += [leaf.option, str(one)]
    return words


def _values(settings: Any) -> Iterator[tuple[str, Any]]:
    """Yield name and value of every leaf."""
    for f in fields(settings):
        value = getattr(settings, f.name)
        if is_dataclass(value):
            yield from _values(value)
        else:
            yield f.name, value


def to_json(settings: Any) -> dict[str, Any]:
    """Return the settings as nested JSON objects."""
    return asdict(settings)


def from_json(cls: type[T], data: Any, where: str = "config") -> T:
    """Return settings from nested JSON objects with exactly the fields of the class.

    Raises:
        UsageError: A field is unknown, missing or invalid; the message names it.
    """
    hints = get_type_hints(cls)
    names = [f.name for f in fields(cls)]  # type: ignore[arg-type]
    if not isinstance(data, dict):
        raise UsageError(f"{where}: expected an object, got {type(data).__name__}")
    for name in [*data, *names]:
        if name not in names or name not in data:
            verb = "unknown" if name not in names else "missing"
            raise UsageError(f"{where}: {verb} field {name!r}")
    values = {}
    for f in fields(cls):  # type: ignore[arg-type]
        if is_dataclass(hints[f.name]):
            values[f.name] = from_json(hints[f.name], data[f.name], f"{where}.{f.name}")
        else:
            leaf = Leaf(f.name, hints[f.name], None, "", f.metadata)
            values[f.name] = _check(leaf, data[f.name], f"{where}.{f.name}")
    return cls(**values)


class Leaf:
    """A field with a value, in contrast to a nested settings class."""

    def __init__(
        self, name: str, kind: Any, default: Any, text: str, metadata: Mapping[str, Any]
    ) -> None:
        self.name, self.default, self.help, self.metadata = name, default, text, metadata
        self.many = get_origin(kind) is tuple
        self.kind = get_args(kind)[0] if self.many else kind
        self.choices = get_args(self.kind) if get_origin(self.kind) is Literal else ()

    @property
    def metavar(self) -> str:
        """Placeholder of the value in the help."""
        return "|".join(self.choices) or {int: "N", float: "X"}.get(self.kind, "NAME")

    @property
    def option(self) -> str:
        """Name of the option; singular for a list, whose option is repeated for each value."""
        name = self.name.removesuffix("s") if self.many else self.name
        return f"--{name.replace('_', '-')}"


def leaves(cls: type) -> Iterator[Leaf]:
    """Yield the leaves of a class and its nested classes, with defaults and help texts."""
    hints, texts = get_type_hints(cls), _docstrings(cls)
    for f in fields(cls):  # type: ignore[arg-type]
        if is_dataclass(hints[f.name]):
            yield from leaves(hints[f.name])  # type: ignore[arg-type]
        else:
            assert f.default is not MISSING
            yield Leaf(f.name, hints[f.name], f.default, texts.get(f.name, ""), f.metadata)


def _map(cls: Any, old: Mapping[str, Any], value: Callable[[Leaf, Any], Any]) -> Any:
    """Return nested settings, with `value(leaf, old)` as the value of every leaf."""
    hints = get_type_hints(cls)
    found = {}
    for f in fields(cls):
        if is_dataclass(hints[f.name]):
            found[f.name] = _map(hints[f.name], old[f.name], value)
        else:
            leaf = Leaf(f.name, hints[f.name], None, "", f.metadata)
            found[f.name] = value(leaf, old[f.name])
    return cls(**found)


def _parse(leaf: Leaf, text: str | Sequence[str]) -> Any:
    """Return the value of an option from its text, or from the texts of a repeated option."""
    option, texts = leaf.option, [text] if isinstance(text, str) else text
    values = []
    for part in [t.strip() for t in texts if t.strip()] if leaf.many else texts:
        try:
            values.append(leaf.kind(part) if leaf.kind in (int, float) else part)
        except ValueError as error:
            raise UsageError(f"{option}: expected {leaf.metavar}, got {text!r}") from error
    return _check(leaf, values if leaf.many else values[0], option)


def _check(leaf: Leaf, value: Any, where: str) -> Any:
    """Return a value after a check of type and range, lists as tuples."""
    if leaf.many:
        if not isinstance(value, list | tuple):
            raise UsageError(f"{where}: expected a list, got {value!r}")
        return tuple(_check_one(leaf, v, where) for v in value)
    return _check_one(leaf, value, where)


def _check_one(leaf: Leaf, value: Any, where: str) -> Any:
    low, high = leaf.metadata.get("low"), leaf.metadata.get("high")
    if leaf.choices:
        if value not in leaf.choices:
            raise UsageError(f"{where}: expected one of {', '.join(leaf.choices)}, got {value!r}")
        return value
    allowed = {int: int, float: int | float, str: str}[leaf.kind]
    if not isinstance(value, allowed) or isinstance(value, bool):
        raise UsageError(f"{where}: expected {leaf.kind.__name__}, got {value!r}")
    if leaf.kind is str:
        return value
    if low is not None and high is not None and not low <= value <= high:
        raise UsageError(f"{where}: expected {low:g} to {high:g}, got {value}")
    return leaf.kind(value)


def _docstrings(cls: type) -> dict[str, str]:
    """Return the docstring of each field on a single line."""
    body = ast.parse(textwrap.dedent(inspect.getsource(cls))).body[0]
    assert isinstance(body, ast.ClassDef)
    found = {}
    for before, after in zip(body.body, body.body[1:], strict=False):
        if (
            isinstance(before, ast.AnnAssign)
            and isinstance(before.target, ast.Name)
            and isinstance(after, ast.Expr)
            and isinstance(after.value, ast.Constant)
            and isinstance(after.value.value, str)
        ):
            found[before.target.id] = " ".join(after.value.value.split())
    return found
