"""Task `hold`: keep a stationary formation."""

from __future__ import annotations

from collections.abc import Sequence

from relpos_env.tasks.geometry.curves import Curve
from relpos_env.tasks.geometry.shapes import Formation
from relpos_env.tasks.moving import MARGIN, AnchorPlacement, Motion, MovingFormation
from relpos_env.tasks.options import finite, half_room
from tracking.arrays import F64


def hold(
    n_cars: int,
    n_envs: int,
    room: tuple[float, float],
    *,
    shape: str | Sequence[Sequence[float]] | F64 = "triangle",
    spacing: float | None = None,
    heading: float = 0.0,
) -> MovingFormation:
    """Build a stationary formation as near as possible to the group's initial mean position.

    All slots are at least 0.3 m from obstacles, where the room allows it.

    Args:
        n_cars: Maximum number of cars, 2 to 20.
        n_envs: Number of environments.
        room: Width along x and depth along y [m].
        shape: One of `SHAPES`, or slots (x ahead, y left) [m], one per car.
        spacing: Distance between neighbours [m]; by default 1 m, or less in small rooms.
        heading: Heading of the formation [rad].

    Raises:
        EnvError: An option is out of range, or the formation does not fit in the room.
    """
    heading = finite("heading", heading)
    formation = Formation(shape, n_cars, spacing)
    half = half_room(room, MARGIN)
    free = half - formation.fit(half, heading)
    placement = AnchorPlacement(
        half=(float(free[0]), float(free[1])), room=(0.5 * room[0], 0.5 * room[1])
    )
    motion = Motion(curve=Curve.point(), heading=heading, placement=placement)
    return MovingFormation(n_cars, n_envs, formation, motion)
