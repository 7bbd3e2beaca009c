"""Looking a name up in a registry, with an error that says what there is."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeVar

from relpos_env.errors import EnvError

Entry = TypeVar("Entry")


def look_up(registry: Mapping[str, Entry], name: object, argument: str) -> Entry:
    """The entry of a name.

    Args:
        registry: Names and entries.
        name: What was asked for.
        argument: The argument it came in, for the message.

    Raises:
        EnvError: No entry of that name.
    """
    if not isinstance(name, str) or name not in registry:
        raise EnvError(f"{argument}: expected one of {', '.join(registry)}, got {name!r}")
    return registry[name]
