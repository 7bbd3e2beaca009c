"""From a correction of the commanded velocity to actions: what all controllers share."""

from __future__ import annotations

from agents.controllers.avoidance import AvoidanceParams, closing_bounds, pushed_back
from agents.controllers.base import Plane, Sight, shortened
from agents.controllers.search import search
from agents.controllers.steering import SteeringParams, drive
from relpos_env.interface.observations.base import F32


def corrected(
    sight: Sight,
    correction: Plane,
    most: float,
    steering: SteeringParams,
    avoidance: AvoidanceParams,
) -> F32:
    """Actions of cars that follow the command, corrected, and come too near to nobody, (..., 2).

    Args:
        sight: What they see.
        correction: (...) [m/s]
        most: Largest correction [m/s].
        steering: The car, and how it pursues.
        avoidance: How near cars may come.
    """
    x, y = shortened(correction, most)
    bounds = closing_bounds(sight, avoidance)
    wanted = pushed_back((sight.command[0] + x, sight.command[1] + y), bounds, avoidance)
    return search(sight, drive(sight, wanted, bounds, steering, avoidance))
