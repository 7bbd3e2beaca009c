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

from dataclasses import dataclass

import numpy as np

from agents.controllers.base import TINY, Plane, Sight, length
from agents.controllers.caution import spread
from agents.controllers.correcting import Correcting, CorrectingParams
from relpos_env.interface.observations import Field
from tracking.arrays import F64


@dataclass(frozen=True, slots=True, kw_only=True)
class RangeOnlyParams(CorrectingParams):
    """How hard cars pull."""

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


class RangeOnly(Correcting[RangeOnlyParams]):
    """Formation by distances."""

    name = "range-only"
    observations = ("estimate", "estimate_cov", "ranges", "truth")

    def __init__(self, fields: tuple[Field, ...], params: RangeOnlyParams | None = None) -> None:
        """See `Correcting`; by default the parameters are those of their class."""
        super().__init__(fields, params or RangeOnlyParams())

    def correction(self, sight: Sight) -> Plane:
        """See the head of this file."""
        return correction(sight, self.params)


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
