"""Looking a name up in a registry of the environments."""

from __future__ import annotations

from functools import partial

from relpos_env.errors import EnvError
from tracking.params.registry import look_up as find

look_up = partial(find, raises=EnvError)
"""`tracking.params.registry.look_up`; its errors are `EnvError`."""


def name_of(thing: object) -> str:
    """Return the name by which `look_up` finds something again."""
    if isinstance(thing, str):
        return thing
    return f"{thing.__module__}:{thing.__qualname__}"  # type: ignore[attr-defined]
