"""What the distance sensors tell: points on walls, boxes and cars that no other source reports.

A beam is a cone, and its reading does not say where in it the nearest surface is. Where the
neighbour on one side reads less, the surface slants towards that side, and so does the point: for a
flat wall, whose distance is h / cos(a) in a direction a off its normal, the difference of the
neighbours at the angles +-b gives a by

    (r_right - r_left) / r  =  2 tan(a) tan(b),

held within the cone. Points near another car whose position is known belong to that car, which is
avoided as such.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, radians, tan

import numpy as np

from agents.controllers.base import TINY, Plane, Sight
from relpos_env.interface.beams import FARTHEST, beam_directions, beam_starts
from tracking.arrays import F64
from tracking.params.short_repr import short_repr

HALF_LENGTH, HALF_WIDTH = 0.21, 0.10
"""[m] Of a car."""
HALF_CONE = radians(13.5)
"""[rad] Of a beam."""
BELONGS = 0.45
"""[m] Points so near to the middle of a known car are of its body, its estimate in error."""
REACH = 0.9 * FARTHEST
"""[m] What is farther is in no car's way."""
ENOUGH = 6
"""[-] With fewer beams the neighbours of one say nothing of it."""
NOTHING = 1e3
"""[m] Where points stand that there are not."""


@dataclass(frozen=True, slots=True)
class Surroundings:
    """Points that are in the way, `NOTHING` away where there is none, each (..., beam)."""

    __repr__ = short_repr

    ahead: F64
    """[m] From the middle of the car."""
    left: F64
    """[m]"""

    @property
    def to_body(self) -> tuple[F64, Plane]:
        """Distances [m] from the body of the car, and directions of length 1; (..., beam)."""
        x = self.ahead - np.clip(self.ahead, -HALF_LENGTH, HALF_LENGTH)
        y = self.left - np.clip(self.left, -HALF_WIDTH, HALF_WIDTH)
        distance = np.sqrt(x * x + y * y)
        inverse = 1.0 / np.maximum(distance, TINY)
        return distance, (x * inverse, y * inverse)


def surroundings(sight: Sight) -> Surroundings | None:
    """What the beams of cars see; None without beams."""
    if sight.near is None:
        return None
    near, n = sight.near, sight.near.shape[-1]
    directions = beam_directions(n)
    starts = beam_starts(directions, HALF_LENGTH, HALF_WIDTH)
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
