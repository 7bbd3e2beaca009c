"""Garbage collection that delays no command."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def short_pauses() -> Iterator[None]:
    """Leave what is there now out of the collections to come.

    Modules and compiled kernels are a hundred thousand objects. A collection that looks through all
    of them is rare and takes 30 to 100 ms: two ticks of the supervisor, or a decision.
    """
    outermost = gc.get_freeze_count() == 0
    gc.collect()
    gc.freeze()
    try:
        yield
    finally:
        if outermost:
            gc.unfreeze()
