"""Records of nodes, pairs and groups, so that kernels get few arguments."""

from __future__ import annotations

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
    names = [f.name for f in fields(params)]
    values = tuple(getattr(params, name) for name in names)
    return as_records(np.array([values], dtype=[(name, "f8") for name in names]))


def with_records(state: Any) -> Any:
    """A state in the form that kernels take; shares its memory."""
    nodes, pairs, group = (as_records(a) for a in (state.nodes, state.pairs, state.group))
    return state._replace(nodes=nodes, pairs=pairs, group=group)
