"""Records of nodes, pairs and groups, so that kernels get few arguments."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import config
from numpy.typing import NDArray

Records = NDArray[Any]


def as_records(array: Records) -> Records:
    """An array of records whose fields the interpreter, too, finds under their names."""
    return array.view(np.recarray) if config.DISABLE_JIT else array


def with_records(state: Any) -> Any:
    """A state in the form that kernels take; shares its memory."""
    nodes, pairs, group = (as_records(a) for a in (state.nodes, state.pairs, state.group))
    return state._replace(nodes=nodes, pairs=pairs, group=group)
