"""A ring that turns: cars keep even places on a circle and circle together.

All accelerate differently, so the group's rotation stays observable to their trackers.
"""

from __future__ import annotations

import numpy as np

from relpos_env.errors import EnvError
from relpos_env.tasks.curves import Curve
from relpos_env.tasks.moving import Motion, MovingFormation
from relpos_env.tasks.options import half_room, not_negative, positive
from relpos_env.tasks.shapes import MIN_SPACING, Formation
from tracking.arrays import F64

SHARE = 0.28
"""[-] Radius of the ring over the smaller side of the room."""


def turning_ring(
    n_cars: int,
    n_envs: int,
    room: tuple[float, float],
    *,
    radius: float | None = None,
    speed: float = 1.0,
    lookahead: float = 0.3,
) -> MovingFormation:
    """Even places on a circle round the room's middle, turning counter-clockwise.

    Args:
        n_cars: Slots for cars, 2 to 20.
        n_envs: Environments.
        room: Width along x and depth along y [m].
        radius: Of the circle [m]; by default `SHARE` of the smaller side of the room.
        speed: Of each car [m/s].
        lookahead: The plan is the velocity of so much later [s].

    Raises:
        EnvError: An option is out of range, or the cars have no room on the ring.
    """
    half = float(half_room(room, 0.0).min())
    r = 2.0 * SHARE * half if radius is None else positive("radius", radius)
    if r > half:
        raise EnvError(f"radius: expected at most {half:.2f} m, got {r:g}")
    if 2.0 * np.pi * r < MIN_SPACING * n_cars:
        raise EnvError(
            f"radius: {n_cars} cars need {MIN_SPACING * n_cars / (2.0 * np.pi):.2f} m, got {r:.2f}"
        )
    motion = Motion(
        curve=Curve.point(),
        rate=positive("speed", speed) / r,
        lookahead=not_negative("lookahead", lookahead),
    )
    return MovingFormation(n_cars, n_envs, Circle(n_cars, r), motion, round_places=True)


class Circle(Formation):
    """Places on a circle of one size, however many cars are present."""

    def __init__(self, n_cars: int, radius: float) -> None:
        super().__init__("ring", n_cars, None)
        self._radius = radius

    def places(self, n: int) -> F64:
        """Places for so many cars, (place, 2) [m]."""
        angle = 2.0 * np.pi * np.arange(n) / n
        places: F64 = self._radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        return places
