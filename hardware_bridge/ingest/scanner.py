"""Where a scanner is on its car: from what it measures to what is near the car's body."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, cos, hypot, sin


@dataclass(frozen=True, slots=True, kw_only=True)
class ScannerMount:
    """The scanner in the frame of the car, x forward and y left of the body's middle."""

    x: float = 0.0
    """[m]"""
    y: float = 0.0
    """[m]"""
    yaw: float = 0.0
    """[rad] Of the scanner's front from the car's, left is positive."""
    length: float = 0.42
    """[m] Of the car's body, along x."""
    width: float = 0.2
    """[m] Along y."""

    def seen(self, bearing: float, distance: float) -> tuple[float, float] | None:
        """What was measured, from the car's body.

        Args:
            bearing: [rad] From the scanner's front, left is positive.
            distance: [m] From the scanner.

        Returns:
            The bearing from the middle of the body [rad], and the distance [m] along that ray from
            where it leaves the body. None for a point of the body itself: a mast, an antenna.
        """
        x = self.x + distance * cos(self.yaw + bearing)
        y = self.y + distance * sin(self.yaw + bearing)
        along, across = abs(x) / (0.5 * self.length), abs(y) / (0.5 * self.width)
        beyond = max(along, across)  # 1 on the edge of the body
        if beyond <= 1.0:
            return None
        return atan2(y, x), hypot(x, y) * (1.0 - 1.0 / beyond)
