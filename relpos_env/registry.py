"""Looking a name up in a registry of the environments."""

from __future__ import annotations

from functools import partial

from relpos_env.errors import EnvError
from tracking.params import registry

look_up = partial(registry.look_up, raises=EnvError)
"""`tracking.params.registry.look_up`; its errors are `EnvError`."""
build = partial(registry.build, raises=EnvError)
"""`tracking.params.registry.build`; its errors are `EnvError`."""


def name_of(thing: object) -> str:
    """Return the name by which `look_up` finds something again."""
    if isinstance(thing, str):
        return thing
    return f"{thing.__module__}:{thing.__qualname__}"  # type: ignore[attr-defined]
