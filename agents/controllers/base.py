"""What a controller is: one car's observation to one car's action."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from relpos_env.interface.observations import Field
from tracking.arrays import F64


class Controller(Protocol):
    """Stateless; the same for every car."""

    def act(self, observation: F64) -> F64:
        """Action of the car that sees the observation, both in the environment's spaces."""


def split_fields(fields: tuple[Field, ...]) -> dict[str, slice]:
    """Where each named stretch of an observation stands."""
    ends = np.cumsum([f.size for f in fields])
    return {f.name: slice(int(e) - f.size, int(e)) for f, e in zip(fields, ends, strict=True)}
