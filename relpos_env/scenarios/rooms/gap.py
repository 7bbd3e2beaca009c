"""A wall across the room with a gap to drive through."""

from __future__ import annotations

import math
from dataclasses import dataclass

from relpos_env.errors import EnvError
from relpos_env.scenarios.rooms.obstacle import THINNEST, Obstacle


@dataclass(frozen=True, slots=True, kw_only=True)
class Gap:
    """Gap in a wall across the room."""

    width: float
    """[m] Clear width between the two parts of the wall."""
    x: float = 0.0
    """[m] x of the middle of the gap."""
    y: float = 0.0
    """[m] y of the middle of the gap."""
    direction: float = 0.0
    """[rad] Direction of passage, perpendicular to the wall."""
    thickness: float = 0.15
    """[m] Thickness of the wall."""

    def __post_init__(self) -> None:
        if not 0.05 <= self.width <= 100.0:
            raise EnvError(f"width: expected 0.05 to 100 m, got {self.width}")
        for name in ("x", "y", "direction"):
            if not abs(getattr(self, name)) <= 200.0:
                raise EnvError(f"{name}: expected -200 to 200, got {getattr(self, name)}")
        if not THINNEST <= self.thickness <= 10.0:
            raise EnvError(f"thickness: expected {THINNEST:g} to 10 m, got {self.thickness}")

    def wall(self, room: tuple[float, float]) -> tuple[Obstacle, ...]:
        """Return the two parts of the wall from the gap to the walls of the room.

        Args:
            room: Size along x and y [m]; the origin is its centre.

        Raises:
            EnvError: The middle of the gap is outside of the room, or a part would be too short.
        """
        if abs(self.x) >= 0.5 * room[0] or abs(self.y) >= 0.5 * room[1]:
            raise EnvError(
                f"gap: expected its middle in the room of {room[0]:g} m x {room[1]:g} m, "
                f"got x = {self.x:g}, y = {self.y:g}"
            )
        pieces = []
        along = self.direction + 0.5 * math.pi
        for side in (1.0, -1.0):
            c, s = side * math.cos(along), side * math.sin(along)
            length = _to_wall(self.x, self.y, c, s, room)
            if length - 0.5 * self.width < THINNEST:
                raise EnvError(
                    f"gap.width: expected less than {2.0 * (length - THINNEST):.2f} m, "
                    f"so that wall is left at both sides, got {self.width:g}"
                )
            middle = 0.5 * (length + 0.5 * self.width)
            pieces.append(
                Obstacle(
                    x=self.x + c * middle,
                    y=self.y + s * middle,
                    width=length - 0.5 * self.width,
                    height=self.thickness,
                    angle=along,
                )
            )
        return tuple(pieces)


def _to_wall(x: float, y: float, c: float, s: float, room: tuple[float, float]) -> float:
    """Return the distance from a point in the room to its walls in a direction (c, s) [m]."""
    ways = []
    for at, step, side in ((x, c, room[0]), (y, s, room[1])):
        if abs(step) > 1e-9:
            ways.append((math.copysign(0.5 * side, step) - at) / step)
    return min(ways)
