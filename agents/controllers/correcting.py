"""From a correction of the commanded velocity to actions: what all controllers share."""

from __future__ import annotations

import numpy as np

from agents.controllers.avoidance import AvoidanceParams, bounded_speed, closing_bounds, pushed_back
from agents.controllers.base import Plane, Sight, shortened
from agents.controllers.bounds import joined
from agents.controllers.clearance import clear_arc, standing_bounds
from agents.controllers.search import search
from agents.controllers.steering import SteeringParams, drive
from agents.controllers.surroundings import surroundings
from relpos_env.interface.actions import MAX_SPEED
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
