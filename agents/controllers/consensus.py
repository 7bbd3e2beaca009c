"""Displacement-based consensus: each car moves so that the others reach their relative targets.

    u_i = command + K / n sum_j W_j ((p_j - p_i) - (p_j - p_i)*),   W_j = (1 + P_j / s^2)^-1

the control law of [1] with the operator's command as feedforward, over the n others that are known
and have a target; errors are weighted by their uncertainty (`caution`). K is larger along the car
than across it, where a correction is delayed until the car has turned. If no car has a target, the
cars gather round their mean position.

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
    """Parameters of the consensus controller."""

    room_of_car: float = 0.25
    """[m] Distance from the mean position kept without targets, per root of the number of cars."""


class Consensus(Correcting[ConsensusParams]):
    """Controller by relative displacements; follows the command alone without estimates."""

    name = "consensus"
    observations = ("estimate", "estimate_cov", "truth")

    def __init__(self, fields: tuple[Field, ...], params: ConsensusParams | None = None) -> None:
        """Check the fields, see `Correcting`; None uses the default parameters."""
        super().__init__(fields, params or ConsensusParams())

    def correction(self, sight: Sight) -> Plane:
        """Return the correction, see the module's docstring."""
        return correction(sight, self.params)


def correction(sight: Sight, params: ConsensusParams) -> Plane:
    """Return the velocity that brings the others to their targets, (...) [m/s]."""
    used = sight.used
    error = sight.pos[0] - sight.target[0], sight.pos[1] - sight.target[1]
    x, y = shrunk(error, sight.certainty, params.trusted_std)
    known = used.sum(axis=-1)
    share = used / np.maximum(known, 1)[..., None]
    x, y = (share * x).sum(axis=-1), (share * y).sum(axis=-1)
    # Without targets, all cars need space round the mean position.
    near = params.room_of_car * np.sqrt(known + 1.0) * ~sight.placed.any(axis=-1)
    far = np.maximum(1.0 - near / np.maximum(np.hypot(x, y), TINY), 0.0)
    return params.gain_ahead * far * x, params.gain_left * far * y
