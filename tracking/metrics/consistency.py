"""Consistency of estimates: NEES and NIS with their chi-square bands.

The squared error over the covariance, ``e^T P^-1 e / d``, and the squared innovation over its
variance have mean 1 if the filter's assumptions hold; over n independent samples the mean lies in
a band of the chi-square distribution [1]. Larger is overconfident, smaller is conservative.

References:
    [1] Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation,
        Wiley 2001, ch. 5.4.
"""

from __future__ import annotations

import numpy as np

from tracking.arrays import F64, Bool
from tracking.errors import ConfigError
from tracking.estimate import TeamEstimate


def chi_square_band(n: int, dof: int, probability: float = 0.95) -> tuple[float, float]:
    """Return the band of the mean of n normalised squares, each divided by its dimension.

    Args:
        n: Independent samples.
        dof: Dimension of each: 1 for a range, 2 or 3 for a position.
        probability: Probability of the band.

    Returns:
        Ends of the band [-].

    Raises:
        ConfigError: A number is out of range.
    """
    from scipy.special import chdtri  # takes 0.1 s, not needed for tracking

    if n < 1 or dof < 1:
        raise ConfigError(f"chi-square band: expected n and dof of 1 or more, got {n} and {dof}")
    if not 0.0 < probability < 1.0:
        raise ConfigError(f"probability: expected 0 to 1, got {probability:g}")
    tail = 0.5 * (1.0 - probability)
    total = n * dof
    return float(chdtri(total, 1.0 - tail)) / total, float(chdtri(total, tail)) / total


def pair_nees(estimate: TeamEstimate, truth_ij_w: F64) -> tuple[F64, Bool]:
    """Return e^T P^-1 e / d of the position errors e of every pair, and a mask of known P.

    Args:
        estimate: Estimate of one run, arrays over (time, pair).
        truth_ij_w: True relative positions, (time, pair, 3) [m].

    Returns:
        NEES, (time, pair) [-], NaN without a covariance, and a mask of covariances, (time, pair).
        The NEES is infinite for a covariance that is not positive definite.
    """
    d = estimate.constellation.dimensions
    cov = estimate.cov[..., :d, :d]
    known = np.trace(cov, axis1=-2, axis2=-1) != 0.0
    is_positive = known & (np.linalg.eigvalsh(cov)[..., 0] > 0.0)
    e = (estimate.pos_ij_w - truth_ij_w)[is_positive][:, :d]
    nees = np.where(known, np.inf, np.nan)
    whitened = np.linalg.solve(cov[is_positive], e[..., None])[..., 0]
    nees[is_positive] = np.sum(e * whitened, axis=-1) / d
    return nees, known
