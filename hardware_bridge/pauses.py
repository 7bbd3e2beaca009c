"""Short pauses of garbage collection, so that it delays no command."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def short_pauses() -> Iterator[None]:
    """Exclude all existing objects from garbage collection within the context.

    Modules and compiled kernels are a hundred thousand objects. A full collection over all of them
    is rare and takes 30 to 100 ms: two ticks of the supervisor, or one control period.
    """
    outermost = gc.get_freeze_count() == 0
    gc.collect()
    gc.freeze()
    try:
        yield
    finally:
        if outermost:
            gc.unfreeze()
