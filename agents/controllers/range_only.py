"""Range-only control: each car descends the gradient of the squared distance errors.

    u_i = command + K / n sum_j w_j (d_ij - d_ij*) n_ij,   d_ij n_ij = p_j - p_i

with the distance d and the direction n of each other car: the gradient of
``sum_j (d_ij - d_ij*)^2 / 2`` with respect to p_i [1], with the operator's command as feedforward.
Distances do not depend on a rotation or reflection of the whole formation, so neither is corrected;
only the command, which turns with the plan, counteracts them.

In modes with positions, d and n are those of the positions. The mode `ranges` has no direction: n
is that of the other's *target* in the body frame. It is correct to first order near the target
formation (where it also keeps the orientation, as far as single pairs can), and wrong by the
bearing error elsewhere. Range rates from stacked observations are not used, since there is no
target rate.

The weight w = 1 / (1 + (sigma / s)^2) decreases with the standard deviation of the distance: that
of the estimate along n, or that of a range by its age and its power difference, which indicates
NLOS. In modes with positions but without a covariance, w is 1.

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
    """Parameters of the range-only controller."""

    range_std: float = 0.1
    """[m] Standard deviation of a new LOS range."""
    nlos_gap: float = 6.0
    """[dB] Power difference above which a range counts as NLOS."""
    nlos_std: float = 0.3
    """[m] Standard deviation of a new NLOS range."""
    drift: float = 0.3
    """[m/s] Increase of a range's standard deviation with its age."""
    doubt: float = 1.0
    """[-] Increase of a range's standard deviation with its error, since the other car is then not
    in the direction of its target. With 0 cars drive each other away."""


class RangeOnly(Correcting[RangeOnlyParams]):
    """Controller by distances."""

    name = "range-only"
    observations = ("estimate", "estimate_cov", "ranges", "truth")

    def __init__(self, fields: tuple[Field, ...], params: RangeOnlyParams | None = None) -> None:
        """Check the fields, see `Correcting`; None uses the default parameters."""
        super().__init__(fields, params or RangeOnlyParams())

    def correction(self, sight: Sight) -> Plane:
        """Return the correction, see the module's docstring."""
        return correction(sight, self.params)


def correction(sight: Sight, params: RangeOnlyParams) -> Plane:
    """Return the velocity that brings the distances to their targets, (...) [m/s]."""
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
    """Return the standard deviations of the distances, (..., other) [m]."""
    if sight.certainty is not None:
        return spread(toward, sight.certainty)
    if sight.age is None or sight.gap is None:
        return np.zeros_like(toward[0])
    base = np.where(sight.gap > params.nlos_gap, params.nlos_std, params.range_std)
    # The direction is that of the target: the larger the distance error, the less it holds.
    doubt = params.doubt * np.abs(length(sight.pos) - length(sight.target))
    std: F64 = base + params.drift * sight.age + doubt
    return std
