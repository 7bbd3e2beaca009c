"""Mounting of a scanner on its car: its measurements relative to the car's body."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, cos, hypot, sin


@dataclass(frozen=True, slots=True, kw_only=True)
class ScannerMount:
    """Pose of the scanner in the car's frame, x forward and y left from the body's centre."""

    x: float = 0.0
    """[m] Position along x."""
    y: float = 0.0
    """[m] Position along y."""
    yaw: float = 0.0
    """[rad] Direction of the scanner's front relative to the car's, left is positive."""
    length: float = 0.42
    """[m] Length of the car's body, along x."""
    width: float = 0.2
    """[m] Width of the car's body, along y."""

    def seen(self, bearing: float, distance: float) -> tuple[float, float] | None:
        """Convert a measurement to bearing and distance from the car's body.

        Args:
            bearing: Direction [rad] from the scanner's front, left is positive.
            distance: Distance [m] from the scanner.

        Returns:
            The bearing from the centre of the body [rad], and the distance [m] along that ray from
            the edge of the body. None for a point of the body itself: a mast, an antenna.
        """
        x = self.x + distance * cos(self.yaw + bearing)
        y = self.y + distance * sin(self.yaw + bearing)
        along, across = abs(x) / (0.5 * self.length), abs(y) / (0.5 * self.width)
        beyond = max(along, across)  # 1 on the edge of the body
        if beyond <= 1.0:
            return None
        return atan2(y, x), hypot(x, y) * (1.0 - 1.0 / beyond)
