"""Follow a leader."""

from __future__ import annotations

from collections.abc import Sequence

from relpos_env.errors import EnvError
from relpos_env.tasks.geometry.curves import make_curve
from relpos_env.tasks.geometry.shapes import Formation
from relpos_env.tasks.moving import MARGIN, Motion, MovingFormation
from relpos_env.tasks.options import half_room, not_negative, positive
from tracking.arrays import F64

TOLD = ("all", "leader")


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
    told: str = "all",
    lookahead: float = 0.3,
) -> MovingFormation:
    """A leader is led along a course; the others keep their places in the frame of its heading.

    The heading is that of the course, not what the leader makes of it: targets come from the
    plan and do not give away the truth. The leader is car 0 or, while that is absent, the
    first car that is present.

    Args:
        n_cars: Slots for cars, 2 to 20.
        n_envs: Environments.
        room: Width along x and depth along y [m].
        shape: One of `SHAPES`, or places (x ahead, y left) [m], one a car; the first is the
            leader's.
        spacing: Of neighbours [m]; by default 1 m, or less where the room asks for it.
        speed: Of the leader [m/s].
        path: Its course, one of `CURVES`, or points [m]; their corners are rounded.
        closed: A course of points goes round.
        told: Who is given the plan: `all`, or the `leader` alone.
        lookahead: The plan is the velocity of so much later [s].

    Raises:
        EnvError: An option is out of range, or there is no room.
    """
    if told not in TOLD:
        raise EnvError(f"told: expected one of {', '.join(TOLD)}, got {told!r}")
    formation = Formation(shape, n_cars, spacing, led=True)
    half = half_room(room, MARGIN)
    # A little less than half of the room is for the followers, since the leader has to turn.
    extent = formation.fit(0.46 * half, None)
    motion = Motion(
        curve=make_curve(path, closed, half, extent),
        speed=positive("speed", speed),
        turning=True,
        lookahead=not_negative("lookahead", lookahead),
    )
    return MovingFormation(n_cars, n_envs, formation, motion, led=True, all_told=told == "all")
