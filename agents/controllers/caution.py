"""Estimates that are unsure count less, in the directions in which they are.

An error e with covariance P counts as ``(1 + P / s^2)^-1 e``: fully if certain, half where the
standard deviation is s. That is the posterior mean of the true error for a prior of standard
deviation s, ridge regression on one measurement.
"""

from __future__ import annotations

import numpy as np

from agents.controllers.base import Certainty, Plane
from tracking.arrays import F64


def shrunk(error: Plane, certainty: Certainty | None, trusted_std: float) -> Plane:
    """Errors by how sure they are, (..., other) [m]; never longer than they were.

    Args:
        error: (..., other) [m]
        certainty: None leaves them alone.
        trusted_std: s [m].
    """
    if certainty is None:
        return error
    ahead, left = certainty.ahead / trusted_std, certainty.left / trusted_std
    a, d, b = 1.0 + ahead * ahead, 1.0 + left * left, certainty.mixed * ahead * left
    det = a * d - b * b  # at least 1, since the correlation is at most 1
    return (d * error[0] - b * error[1]) / det, (a * error[1] - b * error[0]) / det


def spread(direction: Plane, certainty: Certainty) -> F64:
    """Standard deviation in a direction of length 1, (..., other) [m]."""
    x, y = direction[0] * certainty.ahead, direction[1] * certainty.left
    spread: F64 = np.sqrt(np.maximum(x * x + y * y + 2.0 * certainty.mixed * x * y, 0.0))
    return spread
