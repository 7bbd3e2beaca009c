"""Range-only: each car goes down the gradient of the squared errors of distances.

    u_i = command + K / n sum_j w_j (d_ij - d_ij*) n_ij,   d_ij n_ij = p_j - p_i

with the distance d and the direction n of each other car: the gradient of
``sum_j (d_ij - d_ij*)^2 / 2`` with respect to p_i [1], with the operator's command fed forward.
Distances say nothing of a rotation of the whole formation, nor of its mirror image:
both stay as they come about, and only the command, which turns with the plan, speaks against them.

From estimates and the truth, d and n are those of the positions. In the mode `ranges` there is no
direction: n is that of the other's *place*, which the heading turns into the frame of the car. That
is right to first order where the formation is nearly right (and does hold its orientation as far as
single pairs can), and wrong by the bearing error elsewhere. Rates of ranges in a history are not
used: which rate is wanted is not told.

The weight w = 1 / (1 + (sigma / s)^2) falls with the standard deviation of the distance: that of
the estimate along n, or of a range by its age and by the power gap that obstacles leave. Without a
covariance it is 1.

References:
    [1] Krick, Broucke, Francis, Stabilisation of infinitesimally rigid formations of multi-robot
        networks, International Journal of Control 82 (2009) 423.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from agents.controllers.avoidance import AvoidanceParams
from agents.controllers.base import TINY, Plane, Reader, Sight, length
from agents.controllers.caution import spread
from agents.controllers.correcting import corrected
from agents.controllers.steering import SteeringParams
from relpos_env.interface.observations import Field
from relpos_env.interface.observations.base import F32
from tracking.arrays import F64


@dataclass(frozen=True, slots=True, kw_only=True)
class RangeOnlyParams:
    """How hard cars pull."""

    gain_ahead: float = 1.5
    """[1/s] Velocity per distance error along the car."""
    gain_left: float = 1.2
    """[1/s] Velocity per distance error across it."""
    max_correction: float = 0.9
    """[m/s] Largest correction of the commanded velocity."""
    trusted_std: float = 0.3
    """[m] s: a distance as unsure as this counts half."""
    range_std: float = 0.1
    """[m] Of a range in sight, new."""
    nlos_gap: float = 6.0
    """[dB] Power gap from which a range is taken for one behind an obstacle."""
    nlos_std: float = 0.3
    """[m] Of such a range."""
    drift: float = 0.3
    """[m/s] A range is as unsure as this times its age."""
    doubt: float = 1.0
    """[-] Of ranges: a distance is also as unsure as this times its error, since then the other is
    not in the direction of its place. Without it cars drive each other away."""
    steering: SteeringParams = field(default_factory=SteeringParams)
    """The car, and how it pursues."""
    avoidance: AvoidanceParams = field(default_factory=AvoidanceParams)
    """How near cars may come."""


class RangeOnly:
    """Formation by distances."""

    observations = ("estimate", "estimate_cov", "ranges", "truth")
    """Modes that it can read."""

    def __init__(self, fields: tuple[Field, ...], params: RangeOnlyParams | None = None) -> None:
        """Say what is read.

        Args:
            fields: Stretches of an observation.
            params: How hard cars pull.

        Raises:
            UsageError: The observation has neither positions nor ranges.
        """
        self._reader = Reader(fields, "range-only", self.observations)
        self.params = params or RangeOnlyParams()

    def act(self, observations: F32) -> F32:
        """Actions, (..., 2), see `agents.driver.Driver`."""
        p, sight = self.params, self._reader.read(observations)
        velocity = correction(sight, p)
        return corrected(sight, velocity, p.max_correction, p.steering, p.avoidance)


def correction(sight: Sight, params: RangeOnlyParams) -> Plane:
    """Velocity that brings the distances to what they should be, (...) [m/s]."""
    used = sight.used
    distance = length(sight.pos)
    inverse = 1.0 / np.maximum(distance, TINY)
    toward = sight.pos[0] * inverse, sight.pos[1] * inverse
    error = distance - length(sight.target)
    std = _std(sight, toward, params) / params.trusted_std
    share = used / np.maximum(used.sum(axis=-1, keepdims=True), 1) * error / (1.0 + std * std)
    return (
        params.gain_ahead * (share * toward[0]).sum(axis=-1),
        params.gain_left * (share * toward[1]).sum(axis=-1),
    )


def _std(sight: Sight, toward: Plane, params: RangeOnlyParams) -> F64:
    """Standard deviations of the distances, (..., other) [m]."""
    if sight.certainty is not None:
        return spread(toward, sight.certainty)
    if sight.age is None or sight.gap is None:
        return np.zeros_like(toward[0])
    base = np.where(sight.gap > params.nlos_gap, params.nlos_std, params.range_std)
    # The direction is that of the place: the farther off the distance is, the less it holds.
    doubt = params.doubt * np.abs(length(sight.pos) - length(sight.target))
    std: F64 = base + params.drift * sight.age + doubt
    return std
