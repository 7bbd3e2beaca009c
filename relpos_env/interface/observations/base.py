"""Protocol of observation modes: map a view to vectors with named fields and units."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from relpos_env.interface.views import AgentView

F32 = NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class Field:
    """One named field of an observation vector."""

    name: str
    size: int
    unit: str
    meaning: str
    limit: float
    """Values are clipped to +- this limit, so that an observation is always in its space."""
    signed: bool = True
    """False if values are never below 0."""
    per_other: bool = False
    """True if the field consists of equal parts, one per other car in order."""


@runtime_checkable
class ObservationMode(Protocol):
    """Mapping of a view to one vector per car, with the other cars in the order of their index.

    Invariant: a vector is in `space_of(fields)`, and its layout is `fields` in order.
    """

    needs_truth: bool
    """True if the view must hold the true state."""
    fields: tuple[Field, ...]
    """Fields of the vector, in order."""

    def bind(self, view: AgentView, out: F32) -> Callable[[], None]:
        """Return a function that writes the observations of the current view.

        Args:
            view: View of all cars, updated before every call.
            out: Observations, (env, car, size), written; zeros for absent cars.
        """


def space_of(fields: tuple[Field, ...], history: int = 1) -> spaces.Box:
    """Return the observation space of one car.

    Args:
        fields: Fields of one vector.
        history: Number of stacked vectors, the newest first.
    """
    high = np.concatenate([np.full(f.size, f.limit) for f in fields]).astype(np.float32)
    low = np.concatenate([np.full(f.size, -f.limit * f.signed) for f in fields]).astype(np.float32)
    return spaces.Box(np.tile(low, history), np.tile(high, history), dtype=np.float32)


def index_table(fields: tuple[Field, ...]) -> list[dict[str, Any]]:
    """Return index range, name, unit, bounds and meaning of every field, for docs and cards."""
    rows, first = [], 0
    for f in fields:
        rows.append(
            {
                "first": first,
                "last": first + f.size - 1,
                "name": f.name,
                "unit": f.unit,
                "low": -f.limit if f.signed else 0.0,
                "high": f.limit,
                "meaning": f.meaning,
            }
        )
        first += f.size
    return rows


def total_size(fields: tuple[Field, ...]) -> int:
    """Return the length of the vector."""
    return sum(f.size for f in fields)
