"""Move in formation along a path."""

from __future__ import annotations

from collections.abc import Sequence

from relpos_env.tasks.geometry.curves import make_curve
from relpos_env.tasks.geometry.shapes import Formation
from relpos_env.tasks.moving import MARGIN, Motion, MovingFormation
from relpos_env.tasks.options import finite, flag, half_room, not_negative, positive
from tracking.arrays import F64


def travel(
    n_cars: int,
    n_envs: int,
    room: tuple[float, float],
    *,
    shape: str | Sequence[Sequence[float]] | F64 = "triangle",
    spacing: float | None = None,
    speed: float = 0.7,
    path: str | Sequence[Sequence[float]] | F64 = "loop",
    closed: bool = False,
    turning: bool = False,
    heading: float = 0.0,
    lookahead: float = 0.3,
) -> MovingFormation:
    """A formation whose middle follows a path; it begins at the point nearest to the group.

    An open path begins at its first point and ends at its last.

    Args:
        n_cars: Slots for cars, 2 to 20.
        n_envs: Environments.
        room: Width along x and depth along y [m].
        shape: One of `SHAPES`, or places (x ahead, y left) [m], one a car.
        spacing: Of neighbours [m]; by default 1 m, or less where the room asks for it.
        speed: Of the middle [m/s].
        path: One of `CURVES`, or points [m]; their corners are rounded.
        closed: A path of points goes round.
        turning: The formation turns with the path; else it keeps its heading.
        heading: Of a formation that keeps it [rad].
        lookahead: The plan is the velocity of so much later [s].

    Raises:
        EnvError: An option is out of range, or there is no room.
    """
    heading, closed, turning = (
        finite("heading", heading), flag("closed", closed), flag("turning", turning)
    )  # fmt: skip
    formation = Formation(shape, n_cars, spacing)
    half = half_room(room, MARGIN)
    # At most half of the room is for the formation, the rest for the path.
    extent = formation.fit(0.5 * half, None if turning else heading)
    motion = Motion(
        curve=make_curve(path, closed, half, extent),
        speed=positive("speed", speed),
        turning=turning,
        heading=heading,
        lookahead=not_negative("lookahead", lookahead),
    )
    return MovingFormation(n_cars, n_envs, formation, motion)
