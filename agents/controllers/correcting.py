"""From a correction of the commanded velocity to actions: what all controllers share."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import ClassVar, Generic, TypeVar

import numpy as np

from agents.controllers.avoidance import AvoidanceParams, bounded_speed, closing_bounds, pushed_back
from agents.controllers.base import Plane, Reader, Sight, shortened
from agents.controllers.bounds import joined
from agents.controllers.clearance import clear_arc, standing_bounds
from agents.controllers.search import search
from agents.controllers.steering import SteeringParams, drive
from agents.controllers.surroundings import surroundings
from relpos_env.interface.actions import MAX_SPEED
from relpos_env.interface.observations import Field
from relpos_env.interface.observations.base import F32


@dataclass(frozen=True, slots=True, kw_only=True)
class CorrectingParams:
    """How hard cars pull, and what holds them back."""

    gain_ahead: float = 1.5
    """[1/s] Velocity per error along the car."""
    gain_left: float = 1.2
    """[1/s] Velocity per error across it."""
    max_correction: float = 0.9
    """[m/s] Largest correction of the commanded velocity."""
    trusted_std: float = 0.3
    """[m] s: what is as unsure as this counts half, for positions in each direction."""
    steering: SteeringParams = field(default_factory=SteeringParams)
    """The car, and how it pursues."""
    avoidance: AvoidanceParams = field(default_factory=AvoidanceParams)
    """How near cars may come."""


P = TypeVar("P", bound=CorrectingParams)


class Correcting(ABC, Generic[P]):
    """A `agents.driver.Driver` that follows the command with a correction."""

    name: ClassVar[str]
    """For messages."""
    observations: ClassVar[tuple[str, ...]]
    """Modes that it can read."""

    def __init__(self, fields: tuple[Field, ...], params: P) -> None:
        """Say what is read.

        Args:
            fields: Stretches of an observation.
            params: How hard cars pull.

        Raises:
            UsageError: The observation is of a mode that it cannot read.
        """
        self._reader = Reader(fields, self.name, self.observations)
        self.params = params

    @abstractmethod
    def correction(self, sight: Sight) -> Plane:
        """What is added to the commanded velocity, (...) [m/s]."""

    def act(self, observations: F32) -> F32:
        """Actions, (..., 2), see `agents.driver.Driver`."""
        p, sight = self.params, self._reader.read(observations)
        return corrected(sight, self.correction(sight), p.max_correction, p.steering, p.avoidance)


def corrected(
    sight: Sight,
    correction: Plane,
    most: float,
    steering: SteeringParams,
    avoidance: AvoidanceParams,
) -> F32:
    """Actions of cars that follow the command, corrected to keep their distance, (..., 2).

    Args:
        sight: What they see.
        correction: (...) [m/s]
        most: Largest correction [m/s].
        steering: The car, and how it pursues.
        avoidance: How near cars may come.
    """
    x, y = shortened(correction, most)
    bounds, around = closing_bounds(sight, avoidance), surroundings(sight)
    pushing = bounds
    if around is not None:
        pushing = joined(bounds, standing_bounds(around, avoidance.clearance))
    wanted = pushed_back((sight.command[0] + x, sight.command[1] + y), pushing, avoidance)
    actions = search(sight, drive(sight, wanted, bounds, steering, avoidance))
    if around is not None:
        clear_arc(around, sight, actions, steering.wheelbase, avoidance.clearance)
        # Another arc than was wanted may lead to other cars.
        speed = bounded_speed(MAX_SPEED * actions[..., 0].astype(np.float64), bounds, avoidance)
        actions[..., 0] = np.clip(speed / MAX_SPEED, -1.0, 1.0)
    return actions
