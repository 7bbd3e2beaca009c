"""Obstacles: boxes on the floor that block cars and the line of sight."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relpos_env.errors import EnvError
from tracking.arrays import F64

FARTHEST = 200.0
"""[m] Maximum coordinates and sides of obstacles."""
THINNEST = 0.01
"""[m] Minimum side of a box: cars could pass through thinner ones between two steps."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Obstacle:
    """A box on the floor, higher than the antennas."""

    x: float
    """[m] x of the centre."""
    y: float
    """[m] y of the centre."""
    width: float
    """[m] Side along x before rotation."""
    height: float
    """[m] Side along y before rotation."""
    angle: float = 0.0
    """[rad] Rotation, counter-clockwise."""
    movable: bool = False
    """True if cars can push the box."""

    def __post_init__(self) -> None:
        for name in ("x", "y"):
            value = getattr(self, name)
            if not abs(value) <= FARTHEST:
                raise EnvError(f"{name}: expected {-FARTHEST:g} to {FARTHEST:g} m, got {value}")
        for name in ("width", "height"):
            value = getattr(self, name)
            if not THINNEST <= value <= FARTHEST:
                raise EnvError(f"{name}: expected {THINNEST:g} to {FARTHEST:g} m, got {value}")
        if not abs(self.angle) <= 100.0:
            raise EnvError(f"angle: expected a finite angle in radians, got {self.angle}")

    def corners(self) -> F64:
        """Return the corners in order, (4, 2) [m]."""
        c, s = np.cos(self.angle), np.sin(self.angle)
        half = 0.5 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * [self.width, self.height]
        corners: F64 = half @ np.array([[c, s], [-s, c]]) + [self.x, self.y]
        return corners


def boxes_of(obstacles: tuple[Obstacle, ...]) -> F64:
    """Return boxes, (box, 6): centre x y, half width and depth [m], cosine and sine."""
    rows = [
        (o.x, o.y, 0.5 * o.width, 0.5 * o.height, np.cos(o.angle), np.sin(o.angle))
        for o in obstacles
    ]
    return np.array(rows, dtype=np.float64).reshape(-1, 6)
