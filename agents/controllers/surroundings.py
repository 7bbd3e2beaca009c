"""Points on walls, boxes and cars from distance sensors.

A sensor has a cone, and its reading does not contain the direction of the nearest surface in it. If
the neighbour on one side reads less, the surface is slanted, and the point is on that side: for a
flat wall, whose distance is h / cos(a) in a direction a off its normal, the difference of the
neighbours at the angles +-b determines a by

    (r_right - r_left) / r  =  2 tan(a) tan(b),

limited to the cone. Points near a car with a known position are left out: that car is avoided by
its estimate.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, radians, tan

import numpy as np

from agents.controllers.base import TINY, Plane, Sight
from relpos_env.interface.rangefinders import FARTHEST, rangefinder_directions, rangefinder_origins
from tracking.arrays import F64
from tracking.params.short_repr import short_repr

HALF_LENGTH, HALF_WIDTH = 0.21, 0.10
"""[m] Half length and half width of a car."""
HALF_CONE = radians(13.5)
"""[rad] Half angle of a sensor's cone."""
BELONGS = 0.45
"""[m] Distance from the estimated middle of a car within which points belong to its body."""
REACH = 0.9 * FARTHEST
"""[m] Readings above this are ignored."""
ENOUGH = 6
"""[-] Minimum number of sensors for the slant from neighbouring readings."""
NOTHING = 1e3
"""[m] Coordinates of missing points."""


@dataclass(frozen=True, slots=True)
class Surroundings:
    """Points on obstacles, at `NOTHING` where there is none, each (..., ray)."""

    __repr__ = short_repr

    ahead: F64
    """[m] Forward distance from the middle of the car."""
    left: F64
    """[m] Distance to the left of the middle of the car."""

    @property
    def to_body(self) -> tuple[F64, Plane]:
        """Distances [m] from the body of the car, and unit vectors to the points; (..., ray)."""
        x = self.ahead - np.clip(self.ahead, -HALF_LENGTH, HALF_LENGTH)
        y = self.left - np.clip(self.left, -HALF_WIDTH, HALF_WIDTH)
        distance = np.sqrt(x * x + y * y)
        inverse = 1.0 / np.maximum(distance, TINY)
        return distance, (x * inverse, y * inverse)


def surroundings(sight: Sight) -> Surroundings | None:
    """Return the points measured by the distance sensors of cars; None without sensors."""
    if sight.near is None:
        return None
    near, n = sight.near, sight.near.shape[-1]
    directions = rangefinder_directions(n)
    starts = rangefinder_origins(directions, HALF_LENGTH, HALF_WIDTH)
    slant = np.zeros_like(near)
    if n >= ENOUGH:
        whole = starts + near
        right, left = np.roll(whole, 1, axis=-1), np.roll(whole, -1, axis=-1)
        slant = (right - left) / (2.0 * tan(2.0 * pi / n) * whole)
        slant = np.clip(slant, -tan(HALF_CONE), tan(HALF_CONE))
    share = 1.0 / np.sqrt(1.0 + slant * slant)
    x, y = directions.T
    ahead = starts * x + near * share * (x - slant * y)
    left_ = starts * y + near * share * (y + slant * x)
    gone = near > REACH
    if sight.age is None:
        dx = ahead[..., None] - sight.pos[0][..., None, :]
        dy = left_[..., None] - sight.pos[1][..., None, :]
        gone |= ((dx * dx + dy * dy < BELONGS**2) & sight.ok[..., None, :]).any(axis=-1)
    return Surroundings(np.where(gone, NOTHING, ahead), np.where(gone, NOTHING, left_))
