"""Means over episodes and how sure they are.

Intervals hold 95 % and come from the bootstrap: episodes are drawn again with replacement, as
many as there are, and the quantiles of the statistic over the draws are corrected for bias and
skewness (BCa, [1]). Figures of two drivers on the same seeds are drawn in pairs, so that what
makes an episode hard for both cancels.

References:
    [1] Efron, Tibshirani, An Introduction to the Bootstrap, Chapman & Hall 1993, ch. 14.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import stats

from tracking.arrays import F64

LEVEL = 0.95
"""[-] Probability that an interval holds the true value."""
DRAWS = 4999
"""[-] Times the episodes are drawn again."""


@dataclass(frozen=True, slots=True)
class Interval:
    """A figure with the interval that it lies in."""

    value: float
    low: float | None
    """None where there are too few episodes to tell."""
    high: float | None

    @property
    def ends(self) -> list[float] | None:
        """Both ends, ready for JSON."""
        return None if self.low is None or self.high is None else [self.low, self.high]


def mean(values: F64) -> Interval | None:
    """Mean over episodes; None where no episode has the figure.

    Args:
        values: (episode), NaN where it has none.
    """
    found = values[np.isfinite(values)]
    if len(found) == 0:
        return None
    return _interval((found,), _mean)


def ratio(values: F64, reference: F64) -> Interval | None:
    """Ratio of the means of two drivers on the same seeds; below 1 the first has less.

    Args:
        values: (episode), NaN where an episode has none; it is left out of both.
        reference: (episode), by the same seeds.

    Returns:
        None where nothing is left, or the reference is 0.
    """
    both = np.isfinite(values) & np.isfinite(reference)
    if not both.any() or reference[both].mean() == 0.0:
        return None
    return _interval((values[both], reference[both]), _ratio)


def _interval(samples: tuple[F64, ...], statistic: Callable[..., F64]) -> Interval:
    """The statistic of paired samples, with its interval."""
    value = float(statistic(*samples, axis=-1))
    if len(samples[0]) < 2:
        return Interval(value, None, None)
    # Where all draws are the same BCa has no answer, and the quantiles are the figure itself.
    for method in ("BCa", "percentile"):
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            found = stats.bootstrap(
                samples,
                statistic,
                n_resamples=DRAWS,
                batch=500,
                paired=True,
                vectorized=True,
                confidence_level=LEVEL,
                method=method,
                random_state=np.random.default_rng(0),
            ).confidence_interval
        if np.isfinite(found.low) and np.isfinite(found.high):
            return Interval(value, float(found.low), float(found.high))
    return Interval(value, None, None)


def _mean(values: F64, axis: int) -> F64:
    means: F64 = np.mean(values, axis=axis)
    return means


def _ratio(values: F64, reference: F64, axis: int) -> F64:
    ratios: F64 = np.mean(values, axis=axis) / np.mean(reference, axis=axis)
    return ratios
