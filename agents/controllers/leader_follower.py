"""Leader-follower: one car follows the command alone, the others keep relative positions to it.

    u_i = command + K W_l ((p_l - p_i) - (p_l - p_i)*),   W_l = (1 + P_l / s^2)^-1

for the leader l [1]. Observations do not contain the index of the own car, so the leader is chosen
by the targets: **it is the car with the farthest slot in the direction 20 degrees north of the
world's x axis** (in usual shapes no two slots are equally far). Each car compares the targets of
the others with its own slot, by its heading. A car that does not know the leader follows the
farthest known car; one that knows none farther than itself follows the command. There are no
cycles, and in a formation that does not turn the leader stays the same. Without targets, as in a
rendezvous, the leader is the car at the farthest position.

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
"""[rad] Direction in the world frame, from x to y, in which the leader's slot is the farthest."""


class LeaderFollowerParams(CorrectingParams):
    """Parameters of the leader-follower controller."""

    __slots__ = ()


class LeaderFollower(Correcting[LeaderFollowerParams]):
    """Controller of the position relative to one leader."""

    name = "leader-follower"
    observations = ("estimate", "estimate_cov", "truth")

    def __init__(
        self, fields: tuple[Field, ...], params: LeaderFollowerParams | None = None
    ) -> None:
        """Check the fields, see `Correcting`; None uses the default parameters."""
        super().__init__(fields, params or LeaderFollowerParams())

    def correction(self, sight: Sight) -> Plane:
        """Return the correction, see the module's docstring."""
        return correction(sight, self.params)


def leader(sight: Sight) -> Bool:
    """Return a mask of the car that each car follows, one or none of (..., other)."""
    cosine, sine = sight.heading[0][..., None], sight.heading[1][..., None]
    unplaced = ~sight.placed.any(axis=-1, keepdims=True)
    x = np.where(unplaced, sight.pos[0], sight.target[0])
    y = np.where(unplaced, sight.pos[1], sight.target[1])
    east, north = cosine * x - sine * y, sine * x + cosine * y
    # The own slot is at 0. A car without a known heading (zeros) finds none farther.
    lead = np.where(sight.used, cos(FOREMOST) * east + sin(FOREMOST) * north, 0.0)
    first = np.arange(lead.shape[-1]) == lead.argmax(axis=-1)[..., None]
    chosen: Bool = first & (lead > 0.0)
    return chosen


def correction(sight: Sight, params: LeaderFollowerParams) -> Plane:
    """Return the velocity that brings the leader to its target, (...) [m/s]; 0 for the leader."""
    error = sight.pos[0] - sight.target[0], sight.pos[1] - sight.target[1]
    x, y = shrunk(error, sight.certainty, params.trusted_std)
    share = leader(sight)
    return (
        params.gain_ahead * (share * x).sum(axis=-1),
        params.gain_left * (share * y).sum(axis=-1),
    )
