"""Look-up of names: built-in, of installed packages, and `package.module:Name`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from importlib.metadata import entry_points
from inspect import signature
from types import MappingProxyType
from typing import Any, TypeVar

from tracking.errors import ConfigError

Entry = TypeVar("Entry")


def look_up(
    registry: Mapping[str, Entry],
    name: object,
    argument: str,
    *,
    group: str = "",
    raises: type[Exception] = ConfigError,
) -> Entry:
    """Look an entry up by its name.

    Args:
        registry: Built-in names and entries.
        name: A built-in name or, with a group, `package.module:Name`, a name among its entry
            points, or the entry itself, a callable.
        argument: Argument that the name was given for, for the message.
        group: Entry points that other packages declare, such as `relpos_env.tasks`.
        raises: Class of the error.

    Raises:
        ConfigError: No entry of that name, or it cannot be imported.
    """
    if isinstance(name, str) and name in registry:
        return registry[name]
    expected = f"{argument}: expected " + (
        f"one of {', '.join(registry)}" if registry else "a name"
    )
    if not group:
        raise raises(f"{expected}, got {name!r}")
    if callable(name):
        return name  # type: ignore[return-value]
    found = {point.name: point for point in entry_points(group=group)}
    try:
        if isinstance(name, str) and name in found:
            entry: Entry = found[name].load()
            return entry
        if isinstance(name, str) and ":" in name:
            return _import(name)  # type: ignore[no-any-return]
    except Exception as error:  # any error of the user's module
        raise raises(f"{argument}: cannot import {name!r}: {error}") from error
    others = f", {', '.join(sorted(found))}" if found else ""
    raise raises(f"{expected}{others} or package.module:Name, got {name!r}")


def build(
    builder: Callable[..., Entry],
    name: object,
    given: Sequence[Any],
    kind: type,
    expected: str,
    *,
    options: Mapping[str, Any] = MappingProxyType({}),
    raises: type[Exception] = ConfigError,
) -> Entry:
    """Call an entry and check what it returns.

    Args:
        builder: Entry, as `look_up` returns it.
        name: Name or object that `look_up` found it by, for the message.
        given: Arguments of the call.
        kind: Class of the result, or protocol that can be checked at run time.
        expected: Argument and signature for the message, such as "task: expected a function
            (...) that returns a Task".
        options: Keyword arguments of the call.
        raises: Class of the error.

    Raises:
        ConfigError: The entry does not take these arguments, or returns something else.
    """
    try:
        signature(builder).bind(*given, **options)
    except TypeError:
        raise raises(f"{expected}, got {name!r}") from None
    except ValueError:
        pass  # some functions of C have no signature
    built = builder(*given, **options)
    if not isinstance(built, kind):
        raise raises(f"{expected}, got {name!r}, which returns {type(built).__name__}")
    return built


def _import(name: str) -> Any:
    """Return the object `package.module:Name`.

    Raises:
        TypeError: It is not callable.
    """
    module, _, attribute = name.partition(":")
    found: Any = import_module(module)
    for part in attribute.split("."):
        found = getattr(found, part)
    if not callable(found):
        raise TypeError(f"expected something to call, got {found!r}")
    return found
