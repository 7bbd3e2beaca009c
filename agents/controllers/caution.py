"""Weighting of errors by their uncertainty, per direction.

An error e with covariance P is weighted as ``(1 + P / s^2)^-1 e``: fully if certain, by one half
where the standard deviation is s. This is the posterior mean of the true error for a prior of
standard deviation s, or ridge regression on one measurement.
"""

from __future__ import annotations

import numpy as np

from agents.controllers.base import Certainty, Plane
from tracking.arrays import F64


def shrunk(error: Plane, certainty: Certainty | None, trusted_std: float) -> Plane:
    """Return errors weighted by their uncertainty, (..., other) [m]; never longer than before.

    Args:
        error: Position errors, (..., other) [m].
        certainty: Uncertainty of the positions; None returns the errors unchanged.
        trusted_std: Standard deviation s that is weighted by one half [m].
    """
    if certainty is None:
        return error
    ahead, left = certainty.ahead / trusted_std, certainty.left / trusted_std
    a, d, b = 1.0 + ahead * ahead, 1.0 + left * left, certainty.mixed * ahead * left
    det = a * d - b * b  # at least 1, since the correlation is at most 1
    return (d * error[0] - b * error[1]) / det, (a * error[1] - b * error[0]) / det


def spread(direction: Plane, certainty: Certainty) -> F64:
    """Return the standard deviation along a unit vector, (..., other) [m]."""
    x, y = direction[0] * certainty.ahead, direction[1] * certainty.left
    spread: F64 = np.sqrt(np.maximum(x * x + y * y + 2.0 * certainty.mixed * x * y, 0.0))
    return spread
