"""Observation modes. A new mode needs a file next to `relative.py` and a line in `OBSERVATIONS`."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from relpos_env.interface.observations.base import (
    Field,
    ObservationMode,
    index_table,
    space_of,
    total_size,
)
from relpos_env.interface.observations.ranges import Ranges
from relpos_env.interface.observations.relative import RelativePositions
from relpos_env.registry import build, look_up

ModeBuilder = Callable[[int, int], ObservationMode]

OBSERVATIONS: dict[str, ModeBuilder] = {
    "estimate": partial(RelativePositions, needs_truth=False, with_cov=False),
    "estimate_cov": partial(RelativePositions, needs_truth=False, with_cov=True),
    "ranges": Ranges,
    "truth": partial(RelativePositions, needs_truth=True, with_cov=False),
}
"""Name to builder ``(n_cars, distance sensors per car) -> ObservationMode``."""


def observation_mode(name: str | ModeBuilder, n_cars: int, proximity: int = 0) -> ObservationMode:
    """Build an observation mode from its name or builder.

    Args:
        name: One of `OBSERVATIONS`, ``package.module:Name``, a name among the entry points
            ``relpos_env.observations``, or a builder.
        n_cars: Maximum number of cars.
        proximity: Number of distance sensors per car.

    Raises:
        EnvError: There is no mode of this name.
    """
    builder = look_up(OBSERVATIONS, name, "observation", group="relpos_env.observations")
    expected = "observation: expected a function (n_cars, n_sensors) that returns an"
    return build(builder, name, (n_cars, proximity), ObservationMode, f"{expected} ObservationMode")


__all__ = [
    "OBSERVATIONS",
    "Field",
    "ObservationMode",
    "index_table",
    "observation_mode",
    "space_of",
    "total_size",
]
