"""Tuples of arrays passed by address.

Numba passes a tuple of arrays to a compiled function as all numbers of all arrays, a hundred and
more, which costs time at every call and, more so, at compilation. `by_reference` stores the tuple
in memory once; the result is read like the tuple and costs one number.
"""

from __future__ import annotations

from typing import Any

from numba import config, types
from numba.core import cgutils
from numba.core.typing.templates import AttributeTemplate
from numba.extending import (
    infer_getattr,
    intrinsic,
    lower_getattr_generic,
    models,
    register_model,
)


class Reference(types.Type):  # type: ignore[misc]
    """The address of a named tuple."""

    def __init__(self, kind: Any) -> None:
        self.kind = kind
        super().__init__(name=f"Reference({kind})")


@register_model(Reference)
class _ReferenceModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, manager.lookup(kind.kind).get_value_type().as_pointer())


@infer_getattr
class _ReferenceAttributes(AttributeTemplate):  # type: ignore[misc]
    key = Reference

    def generic_resolve(self, reference: Any, name: str) -> Any:
        fields = reference.kind.fields
        return reference.kind.types[fields.index(name)] if name in fields else None


@lower_getattr_generic(Reference)
def _read(context: Any, builder: Any, kind: Any, value: Any, name: str) -> Any:
    at = kind.kind.fields.index(name)
    return builder.load(cgutils.gep_inbounds(builder, value, 0, at))


@intrinsic
def _by_reference(context: Any, named: Any) -> Any:
    def generate(target: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        slot = cgutils.alloca_once(builder, arguments[0].type)
        builder.store(arguments[0], slot)
        return slot

    return Reference(named)(named), generate


def _itself(named: Any) -> Any:
    return named


by_reference = _itself if config.DISABLE_JIT else _by_reference
"""Function that returns the address of a named tuple, valid until the calling kernel returns."""
