"""Displacement-based consensus: each car moves so that the others come to where they should be.

    u_i = command + K / n sum_j W_j ((p_j - p_i) - (p_j - p_i)*),   W_j = (1 + P_j / s^2)^-1

the law of [1] with the operator's command fed forward, over the n others that are known and have
a place; estimates count by how sure they are (`caution`). K is larger along the car than across
it, where a correction has to wait until the car has turned. Where nobody has a place, the cars
gather round their middle.

References:
    [1] Oh, Park, Ahn, A survey of multi-agent formation control, Automatica 53 (2015) 424,
        section 4.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from agents.controllers.avoidance import AvoidanceParams
from agents.controllers.base import TINY, Plane, Reader, Sight
from agents.controllers.caution import shrunk
from agents.controllers.correcting import corrected
from agents.controllers.steering import SteeringParams
from relpos_env.interface.observations import Field
from relpos_env.interface.observations.base import F32


@dataclass(frozen=True, slots=True, kw_only=True)
class ConsensusParams:
    """How hard cars pull."""

    gain_ahead: float = 1.5
    """[1/s] Velocity per displacement error along the car."""
    gain_left: float = 1.2
    """[1/s] Velocity per displacement error across it."""
    max_correction: float = 0.9
    """[m/s] Largest correction of the commanded velocity."""
    trusted_std: float = 0.3
    """[m] s: an estimate counts half in a direction in which it is as unsure as this."""
    room_of_car: float = 0.25
    """[m] Cars without places come as near to the middle as this times the root of their number."""
    steering: SteeringParams = field(default_factory=SteeringParams)
    """The car, and how it pursues."""
    avoidance: AvoidanceParams = field(default_factory=AvoidanceParams)
    """How near cars may come."""


class Consensus:
    """Formation by relative displacements; follows the command alone while nothing is known."""

    observations = ("estimate", "estimate_cov", "truth")
    """Modes that it can read."""

    def __init__(self, fields: tuple[Field, ...], params: ConsensusParams | None = None) -> None:
        """Say what is read.

        Args:
            fields: Stretches of an observation.
            params: How hard cars pull.

        Raises:
            UsageError: The observation has no positions.
        """
        self._reader = Reader(fields, "consensus", self.observations)
        self.params = params or ConsensusParams()

    def act(self, observations: F32) -> F32:
        """Actions, (..., 2), see `agents.driver.Driver`."""
        p, sight = self.params, self._reader.read(observations)
        velocity = correction(sight, p)
        return corrected(sight, velocity, p.max_correction, p.steering, p.avoidance)


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
