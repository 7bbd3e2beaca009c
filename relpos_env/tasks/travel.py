"""Task `travel`: move in formation along a path."""

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
    """Build a formation whose middle follows a path.

    A closed path begins at the point nearest to the group, an open one at its first point.

    Args:
        n_cars: Maximum number of cars, 2 to 20.
        n_envs: Number of environments.
        room: Width along x and depth along y [m].
        shape: One of `SHAPES`, or slots (x ahead, y left) [m], one per car.
        spacing: Distance between neighbours [m]; by default 1 m, or less in small rooms.
        speed: Speed of the middle [m/s].
        path: One of `CURVES`, or points [m] with rounded corners.
        closed: True if a path of points is a closed loop.
        turning: True if the formation turns with the path; else it keeps its heading.
        heading: Heading of a formation that does not turn [rad].
        lookahead: Lead time of the reference velocity [s].

    Raises:
        EnvError: An option is out of range, or the formation does not fit in the room.
    """
    formation, motion = plan_travel(
        n_cars, room, shape, spacing, speed, path, closed, turning, heading, lookahead
    )
    return MovingFormation(n_cars, n_envs, formation, motion)


def plan_travel(
    n_cars: int,
    room: tuple[float, float],
    shape: str | Sequence[Sequence[float]] | F64,
    spacing: float | None,
    speed: float,
    path: str | Sequence[Sequence[float]] | F64,
    closed: bool,
    turning: bool,
    heading: float,
    lookahead: float,
) -> tuple[Formation, Motion]:
    """Return the formation and its motion from the options of `travel`."""
    heading, closed, turning = (
        finite("heading", heading), flag("closed", closed), flag("turning", turning)
    )  # fmt: skip
    formation = Formation(shape, n_cars, spacing)
    half = half_room(room, MARGIN)
    # The formation may take half of the room; the rest is for the path.
    extent = formation.fit(0.5 * half, None if turning else heading)
    motion = Motion(
        curve=make_curve(path, closed, half, extent),
        speed=positive("speed", speed),
        turning=turning,
        heading=heading,
        lookahead=not_negative("lookahead", lookahead),
    )
    return formation, motion
