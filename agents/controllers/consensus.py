"""Displacement-based consensus: each car moves so that the others come to where they should be.

    u_i = command + K / n sum_j W_j ((p_j - p_i) - (p_j - p_i)*),   W_j = (1 + P_j / s^2)^-1

the law of [1] with the operator's command fed forward, over the n others that are known and have
a place; estimates count by how sure they are (`caution`). K is larger along the car than across
it, where a correction has to wait until the car has turned. Where no car has a place, the cars
gather round their middle.

References:
    [1] Oh, Park, Ahn, A survey of multi-agent formation control, Automatica 53 (2015) 424,
        section 4.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from agents.controllers.base import TINY, Plane, Sight
from agents.controllers.caution import shrunk
from agents.controllers.correcting import Correcting, CorrectingParams
from relpos_env.interface.observations import Field


@dataclass(frozen=True, slots=True, kw_only=True)
class ConsensusParams(CorrectingParams):
    """How hard cars pull."""

    room_of_car: float = 0.25
    """[m] Cars without places come as near to the middle as this times the root of their number."""


class Consensus(Correcting[ConsensusParams]):
    """Formation by relative displacements; follows the command alone while nothing is known."""

    name = "consensus"
    observations = ("estimate", "estimate_cov", "truth")

    def __init__(self, fields: tuple[Field, ...], params: ConsensusParams | None = None) -> None:
        """See `Correcting`; by default the parameters are those of their class."""
        super().__init__(fields, params or ConsensusParams())

    def correction(self, sight: Sight) -> Plane:
        """See the head of this file."""
        return correction(sight, self.params)


def correction(sight: Sight, params: ConsensusParams) -> Plane:
    """Velocity that brings the others to their places, (...) [m/s]."""
    used = sight.used
    error = sight.pos[0] - sight.target[0], sight.pos[1] - sight.target[1]
    x, y = shrunk(error, sight.certainty, params.trusted_std)
    known = used.sum(axis=-1)
    share = used / np.maximum(known, 1)[..., None]
    x, y = (share * x).sum(axis=-1), (share * y).sum(axis=-1)
    # Cars without places need room for all of them in the middle.
    near = params.room_of_car * np.sqrt(known + 1.0) * ~sight.placed.any(axis=-1)
    far = np.maximum(1.0 - near / np.maximum(np.hypot(x, y), TINY), 0.0)
    return params.gain_ahead * far * x, params.gain_left * far * y
