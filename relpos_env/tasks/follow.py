"""Task `follow`: a formation led along a course."""

from __future__ import annotations

from collections.abc import Sequence

from relpos_env.errors import EnvError
from relpos_env.tasks.geometry.curves import make_curve
from relpos_env.tasks.geometry.shapes import Formation
from relpos_env.tasks.moving import MARGIN, Motion, MovingFormation
from relpos_env.tasks.options import half_room, not_negative, positive
from tracking.arrays import F64

INFORMED = ("all", "leader")


def follow(
    n_cars: int,
    n_envs: int,
    room: tuple[float, float],
    *,
    shape: str | Sequence[Sequence[float]] | F64 = "triangle",
    spacing: float | None = None,
    speed: float = 0.6,
    path: str | Sequence[Sequence[float]] | F64 = "loop",
    closed: bool = True,
    informed: str = "all",
    lookahead: float = 0.3,
) -> MovingFormation:
    """Build a formation in a frame that moves and turns with the course of a leader.

    The frame has the heading of the course, not the leader's own, so targets do not depend on
    the true state. The leader is the first car that is present.

    Args:
        n_cars: Maximum number of cars, 2 to 20.
        n_envs: Number of environments.
        room: Width along x and depth along y [m].
        shape: One of `SHAPES`, or slots (x ahead, y left) [m], one per car; the first is the
            leader's.
        spacing: Distance between neighbours [m]; by default 1 m, or less in small rooms.
        speed: Speed of the leader [m/s].
        path: Course of the leader, one of `CURVES`, or points [m] with rounded corners.
        closed: True if a course of points is a closed loop.
        informed: Cars that receive the reference velocity: `all`, or the `leader` alone.
        lookahead: Lead time of the reference velocity [s].

    Raises:
        EnvError: An option is out of range, or the formation does not fit in the room.
    """
    if informed not in INFORMED:
        raise EnvError(f"informed: expected one of {', '.join(INFORMED)}, got {informed!r}")
    formation = Formation(shape, n_cars, spacing, led=True)
    half = half_room(room, MARGIN)
    # The followers may take a little less than half of the room, since the leader has to turn.
    extent = formation.fit(0.46 * half, None)
    motion = Motion(
        curve=make_curve(path, closed, half, extent),
        speed=positive("speed", speed),
        turning=True,
        lookahead=not_negative("lookahead", lookahead),
    )
    return MovingFormation(
        n_cars, n_envs, formation, motion, led=True, all_informed=informed == "all"
    )
