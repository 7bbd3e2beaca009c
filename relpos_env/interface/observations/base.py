"""What an observation mode is: a view to vectors, with names and units for each number."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from relpos_env.interface.views import AgentView

F32 = NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class Field:
    """One named stretch of an observation vector."""

    name: str
    size: int
    unit: str
    meaning: str
    limit: float
    """Values are cut at +- this, so that an observation is always inside its space."""
    signed: bool = True
    """False if they are never below 0."""
    per_other: bool = False
    """Whether it is cut into equal pieces, one for each of the others in order."""


class ObservationMode(Protocol):
    """Views to one vector a car. The others come in the order of their numbers, oneself left out.

    Law: a vector is inside `space_of(fields)`, and its layout is `fields` in order.
    """

    needs_truth: bool
    """True if the view must be made from the true positions."""
    fields: tuple[Field, ...]
    """The stretches of the vector, in order."""

    def bind(self, view: AgentView, out: F32) -> Callable[[], None]:
        """What writes observations from a view that is filled again before every call.

        Args:
            view: Of all cars.
            out: (env, car, size), written; zeros for absent cars.
        """


def space_of(fields: tuple[Field, ...], history: int = 1) -> spaces.Box:
    """The observation space of one car.

    Args:
        fields: Its stretches.
        history: So many vectors, the newest first.
    """
    high = np.concatenate([np.full(f.size, f.limit) for f in fields]).astype(np.float32)
    low = np.concatenate([np.full(f.size, -f.limit * f.signed) for f in fields]).astype(np.float32)
    return spaces.Box(np.tile(low, history), np.tile(high, history), dtype=np.float32)


def index_table(fields: tuple[Field, ...]) -> list[dict[str, Any]]:
    """Where every stretch stands, for documents and cards: first, last, name, unit, meaning."""
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
    """Length of the vector."""
    return sum(f.size for f in fields)
