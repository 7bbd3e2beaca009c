"""Records of nodes, pairs and groups, so that kernels get few arguments."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any

import numpy as np
from numba import config
from numpy.typing import NDArray

Records = NDArray[Any]


def as_records(array: Records) -> Records:
    """An array of records whose fields the interpreter, too, finds under their names."""
    return array.view(np.recarray) if config.DISABLE_JIT else array


def record_of(params: Any) -> Records:
    """The numbers of a params class for kernels, (1)."""
    return as_records(coefficients([params], {}))


def coefficients(parts: Sequence[Any], derived: Mapping[str, float], **integers: int) -> Records:
    """The constants of kernels, (1): numbers of params classes and what is derived from them.

    Args:
        parts: Params classes. Of fields with one name, the first counts.
        derived: By name; in place of fields of that name.
        integers: The same, as integers.
    """
    numbers = {
        field.name: getattr(part, field.name)
        for part in reversed(parts)
        for field in fields(part)
        if field.type in ("float", "int", "bool") and field.name not in integers
    } | dict(derived)
    kinds = [*((name, "f8") for name in numbers), *((name, "i8") for name in integers)]
    return np.array([(*numbers.values(), *integers.values())], dtype=kinds)


def with_records(state: Any) -> Any:
    """A state in the form that kernels take; shares its memory."""
    nodes, pairs, group = (as_records(a) for a in (state.nodes, state.pairs, state.group))
    return state._replace(nodes=nodes, pairs=pairs, group=group)
