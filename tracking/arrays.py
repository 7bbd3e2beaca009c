"""Array types used in annotations, and arrays that compiled code reads fast."""

import numpy as np
from numpy.typing import NDArray

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]
Bool = NDArray[np.bool_]

LINE = 8
"""Doubles in a cache line, and in the widest vectors that processors load at a time."""


def whole_lines(n: int) -> int:
    """Return the least multiple of `LINE` that is at least n."""
    return -(-n // LINE) * LINE


def aligned(*shape: int) -> F64:
    """Return zeros aligned to a cache line; every row is aligned if its length is `whole_lines`.

    A vector across two cache lines takes twice as long to load.
    """
    size = int(np.prod(shape))
    room = np.zeros(size + LINE)
    first = -(room.ctypes.data // room.itemsize) % LINE
    return room[first : first + size].reshape(shape)
