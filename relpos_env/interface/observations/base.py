"""What an observation mode is: a view to a vector, with names and units for each number."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from gymnasium import spaces

from relpos_env.interface.views import AgentView
from tracking.arrays import F64


@dataclass(frozen=True, slots=True)
class Field:
    """One named stretch of an observation vector."""

    name: str
    size: int
    unit: str
    meaning: str
    limit: float
    """Values are clipped to +- this, so that an observation is always inside its space."""


class ObservationMode(Protocol):
    """A view of every car to one vector a car.

    Law: the vector is inside `space`, and its layout is `fields` in order.
    """

    @property
    def needs_truth(self) -> bool:
        """True if the view must be made from the true positions."""

    @property
    def fields(self) -> tuple[Field, ...]:
        """The stretches of the vector, in order."""

    def space(self) -> spaces.Box:
        """The observation space of one car."""

    def observe(self, view: AgentView) -> F64:
        """Observations of every car, (car, size)."""
