"""Memory of environments: size of their arrays, and resident memory of the process."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np

STATM = Path("/proc/self/statm")
OWN = ("relpos_env.", "tracking.")


def array_bytes(root: Any) -> int:
    """Return the bytes of all arrays reachable from an object; shared memory counts once.

    Args:
        root: Object, searched recursively through attributes, tuples, lists and dicts.
    """
    seen: set[int] = set()
    total, waiting = 0, [root]
    while waiting:
        one = waiting.pop()
        if isinstance(one, np.ndarray):
            while isinstance(one.base, np.ndarray):
                one = one.base
        if id(one) in seen:
            continue
        seen.add(id(one))
        if isinstance(one, np.ndarray):
            total += one.nbytes
        elif isinstance(one, tuple | list):
            waiting.extend(one)
        elif isinstance(one, dict):
            waiting.extend(one.values())
        elif type(one).__module__.startswith(OWN):
            slots = (getattr(one, name, None) for name in getattr(type(one), "__slots__", ()))
            waiting.extend((*getattr(one, "__dict__", {}).values(), *slots))
    return total


def resident_bytes() -> int | None:
    """Return the resident memory of this process [byte]; None if the system does not report it."""
    try:
        pages = int(STATM.read_text().split()[1])
    except OSError:
        return None
    return pages * os.sysconf("SC_PAGE_SIZE")
