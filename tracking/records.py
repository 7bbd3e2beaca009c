"""Records of nodes, pairs and groups, which keep kernel arguments few."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any

import numpy as np
from numba import config
from numpy.typing import NDArray

Records = NDArray[Any]


def as_records(array: Records) -> Records:
    """Return an array of records whose fields are attributes without compilation, too."""
    return array.view(np.recarray) if config.DISABLE_JIT else array


def record_of(params: Any) -> Records:
    """Return the numbers of a params class for kernels, (1)."""
    return as_records(coefficients([params], {}))


def coefficients(parts: Sequence[Any], derived: Mapping[str, float], **integers: int) -> Records:
    """Return the constants of kernels, (1): numbers of params classes and derived numbers.

    Args:
        parts: Params classes; the first of several fields of one name is used.
        derived: Derived numbers by name; they replace fields of that name.
        integers: Integers by name; they replace fields of that name.
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
    """Return a state in the form that kernels take; shares its memory."""
    nodes, pairs, group = (as_records(a) for a in (state.nodes, state.pairs, state.group))
    return state._replace(nodes=nodes, pairs=pairs, group=group)
