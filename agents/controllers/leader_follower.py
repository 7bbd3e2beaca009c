"""Leader-follower: one car follows the command alone, the others keep their place relative to it.

    u_i = command + K W_l ((p_l - p_i) - (p_l - p_i)*),   W_l = (1 + P_l / s^2)^-1

for the leader l; [1]. An observation has no number of the own car, so the leader is chosen by what
all cars are told alike: **it is the car whose place is farthest east by north** (20 degrees north
of the x axis of the world: in usual shapes no two cars are equally far there), which each finds by
its heading among the places of the others and its own. A car that does not know the leader follows
the farthest of those that it knows; one that knows none farther than itself follows the command. So
there are no cycles, and in a formation that does not turn the leader stays the same. Without
places, as at a rendezvous, it is the car that is farthest.

References:
    [1] Desai, Ostrowski, Kumar, Modeling and control of formations of nonholonomic mobile robots,
        IEEE Transactions on Robotics and Automation 17 (2001) 905.
"""

from __future__ import annotations

from math import cos, radians, sin

import numpy as np

from agents.controllers.base import Plane, Sight
from agents.controllers.caution import shrunk
from agents.controllers.correcting import Correcting, CorrectingParams
from relpos_env.interface.observations import Field
from tracking.arrays import Bool

FOREMOST = radians(20.0)
"""[rad] Direction in the room, from x to y, in which the leader's place is the farthest."""


class LeaderFollowerParams(CorrectingParams):
    """How hard followers pull."""

    __slots__ = ()


class LeaderFollower(Correcting[LeaderFollowerParams]):
    """Places relative to one car that leads."""

    name = "leader-follower"
    observations = ("estimate", "estimate_cov", "truth")

    def __init__(
        self, fields: tuple[Field, ...], params: LeaderFollowerParams | None = None
    ) -> None:
        """See `Correcting`; by default the parameters are those of their class."""
        super().__init__(fields, params or LeaderFollowerParams())

    def correction(self, sight: Sight) -> Plane:
        """See the head of this file."""
        return correction(sight, self.params)


def leader(sight: Sight) -> Bool:
    """Whom each car follows, True for one or none of (..., other)."""
    cosine, sine = sight.heading[0][..., None], sight.heading[1][..., None]
    unplaced = ~sight.placed.any(axis=-1, keepdims=True)
    x = np.where(unplaced, sight.pos[0], sight.target[0])
    y = np.where(unplaced, sight.pos[1], sight.target[1])
    east, north = cosine * x - sine * y, sine * x + cosine * y
    # The own place is at 0. A car that does not know its heading knows none farther.
    lead = np.where(sight.used, cos(FOREMOST) * east + sin(FOREMOST) * north, 0.0)
    first = np.arange(lead.shape[-1]) == lead.argmax(axis=-1)[..., None]
    chosen: Bool = first & (lead > 0.0)
    return chosen


def correction(sight: Sight, params: LeaderFollowerParams) -> Plane:
    """Velocity that brings the leader to its place, (...) [m/s]; 0 of who leads."""
    error = sight.pos[0] - sight.target[0], sight.pos[1] - sight.target[1]
    x, y = shrunk(error, sight.certainty, params.trusted_std)
    share = leader(sight)
    return (
        params.gain_ahead * (share * x).sum(axis=-1),
        params.gain_left * (share * y).sum(axis=-1),
    )
