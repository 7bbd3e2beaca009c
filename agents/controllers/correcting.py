"""Base of all controllers: actions from a correction of the commanded velocity."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import ClassVar, Generic, TypeVar

import numpy as np

from agents.controllers.avoidance import AvoidanceParams, bounded_speed, closing_bounds, pushed_back
from agents.controllers.base import Plane, Reader, Sight, shortened
from agents.controllers.bounds import joined
from agents.controllers.clearance import clear_arc, clearance_bounds
from agents.controllers.search import search
from agents.controllers.steering import SteeringParams, drive
from agents.controllers.surroundings import surroundings
from relpos_env.interface.actions import MAX_SPEED
from relpos_env.interface.observations import Field
from relpos_env.interface.observations.base import F32


@dataclass(frozen=True, slots=True, kw_only=True)
class CorrectingParams:
    """Gains and limits of the correction."""

    gain_ahead: float = 1.5
    """[1/s] Velocity per error along the car."""
    gain_left: float = 1.2
    """[1/s] Velocity per error across the car."""
    max_correction: float = 0.9
    """[m/s] Largest correction of the commanded velocity."""
    trusted_std: float = 0.3
    """[m] Standard deviation s at which a position error is weighted by one half, per direction."""
    steering: SteeringParams = field(default_factory=SteeringParams)
    """Parameters of the car and of path pursuit."""
    avoidance: AvoidanceParams = field(default_factory=AvoidanceParams)
    """Parameters of collision avoidance."""


P = TypeVar("P", bound=CorrectingParams)


class Correcting(ABC, Generic[P]):
    """An `agents.driver.Driver` that follows the command with a correction."""

    name: ClassVar[str]
    """Name in errors."""
    observations: ClassVar[tuple[str, ...]]
    """Supported observation modes."""

    def __init__(self, fields: tuple[Field, ...], params: P) -> None:
        """Check the fields.

        Args:
            fields: Fields of an observation.
            params: Gains and limits.

        Raises:
            UsageError: The observation mode is not supported.
        """
        self._reader = Reader(fields, self.name, self.observations)
        self.params = params

    @abstractmethod
    def correction(self, sight: Sight) -> Plane:
        """Return the velocity that is added to the command, (...) [m/s]."""

    def act(self, observations: F32) -> F32:
        """Return the actions, (..., 2), see `agents.driver.Driver`."""
        p, sight = self.params, self._reader.read(observations)
        return corrected(sight, self.correction(sight), p.max_correction, p.steering, p.avoidance)


def corrected(
    sight: Sight,
    correction: Plane,
    most: float,
    steering: SteeringParams,
    avoidance: AvoidanceParams,
) -> F32:
    """Return the actions for a corrected command with collision avoidance, (..., 2).

    Args:
        sight: Perceived state.
        correction: Correction of the commanded velocity, (...) [m/s].
        most: Largest correction [m/s].
        steering: Parameters of the car and of path pursuit.
        avoidance: Parameters of collision avoidance.
    """
    x, y = shortened(correction, most)
    bounds, around = closing_bounds(sight, avoidance), surroundings(sight)
    pushing = bounds
    if around is not None:
        pushing = joined(bounds, clearance_bounds(around, avoidance.clearance))
    desired = pushed_back((sight.command[0] + x, sight.command[1] + y), pushing, avoidance)
    actions = search(sight, drive(sight, desired, bounds, steering, avoidance))
    if around is not None:
        clear_arc(around, sight, actions, steering.wheelbase, avoidance.clearance)
        # The new arc may lead to other cars.
        speed = bounded_speed(MAX_SPEED * actions[..., 0].astype(np.float64), bounds, avoidance)
        actions[..., 0] = np.clip(speed / MAX_SPEED, -1.0, 1.0)
    return actions
