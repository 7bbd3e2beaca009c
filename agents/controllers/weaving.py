"""Observability-aware consensus: cars weave round their way while their estimates are uncertain.

Straight driving at constant speed tells a tracker little: ranges along one direction do not show
the rotation of a group, and constant errors of heading and acceleration stay. Turning and lateral
acceleration do [1]. So a car whose estimates of the others are uncertain steers to one side until
it is `width` off its way, then to the other: its own steering angle is the memory of the side.

References:
    [1] Batista, Silvestre, Oliveira, Single range aided navigation and source localization:
        observability and filter design, Systems & Control Letters 60 (2011) 665.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from agents.controllers.base import Plane, Sight, length
from agents.controllers.consensus import ConsensusParams, correction
from agents.controllers.correcting import Correcting
from relpos_env.interface.observations import Field
from tracking.arrays import F64


@dataclass(frozen=True, slots=True, kw_only=True)
class WeavingParams(ConsensusParams):
    """Parameters of the weaving controller."""

    width: float = 0.4
    """[rad] Angle from the way at which a car turns back. Larger: more information, less
    accuracy."""
    push: float = 0.6
    """[-] Lateral velocity over that along the way."""
    certain: float = 0.05
    """[m] Expected error of the least certain other up to which a car drives straight."""
    uncertain: float = 0.15
    """[m] Expected error from which it weaves with all its `push`."""


class Weaving(Correcting[WeavingParams]):
    """Consensus that drives for information; without covariances it always weaves."""

    name = "weaving"
    observations = ("estimate", "estimate_cov", "truth")

    def __init__(self, fields: tuple[Field, ...], params: WeavingParams | None = None) -> None:
        """Check the fields, see `Correcting`; None uses the default parameters."""
        super().__init__(fields, params or WeavingParams())

    def correction(self, sight: Sight) -> Plane:
        """Return the correction of `consensus` plus the lateral velocity of the weave."""
        x, y = correction(sight, self.params)
        q = self.params
        way = sight.command[0] + x, sight.command[1] + y
        off = np.arctan2(way[1], way[0])
        side = np.where(np.abs(off) > q.width, np.sign(off), np.sign(sight.steering))
        return x, y + q.push * self._share(sight) * side * length(way)

    def _share(self, sight: Sight) -> F64 | float:
        """Return the share of `push` for the uncertainty of the others, 0 to 1, (...)."""
        if sight.certainty is None:
            return 1.0
        q, expected = self.params, np.hypot(sight.certainty.ahead, sight.certainty.left)
        worst = np.where(sight.used, expected, 0.0).max(axis=-1, initial=0.0)
        return np.asarray(np.clip((worst - q.certain) / (q.uncertain - q.certain), 0.0, 1.0))
