"""Means over episodes with confidence intervals.

Intervals have 95 % confidence and come from the bias-corrected and accelerated bootstrap (BCa,
[1]): episodes are resampled with replacement. Two drivers on the same seeds are resampled in
pairs, which cancels the common difficulty of an episode.

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
"""[-] Confidence level of the intervals."""
DRAWS = 4999
"""[-] Number of bootstrap resamples."""


@dataclass(frozen=True, slots=True)
class Interval:
    """An estimate with its confidence interval."""

    value: float
    low: float | None
    """Lower end; None if there are too few episodes."""
    high: float | None

    @property
    def ends(self) -> list[float] | None:
        """Both ends, for JSON."""
        return None if self.low is None or self.high is None else [self.low, self.high]


def mean(values: F64) -> Interval | None:
    """Return the mean over episodes; None if all values are NaN.

    Args:
        values: Metric by episode, (episode,); NaN where undefined.
    """
    found = values[np.isfinite(values)]
    if len(found) == 0:
        return None
    return _interval((found,), _mean)


def ratio(values: F64, reference: F64) -> Interval | None:
    """Return the ratio of the means of two drivers on the same seeds.

    Args:
        values: Metric by episode, (episode,); episodes with NaN in either argument are omitted.
        reference: Metric of the reference driver on the same seeds, (episode,).

    Returns:
        None if no episode remains or the mean of the reference is 0.
    """
    both = np.isfinite(values) & np.isfinite(reference)
    if not both.any() or reference[both].mean() == 0.0:
        return None
    return _interval((values[both], reference[both]), _ratio)


def _interval(samples: tuple[F64, ...], statistic: Callable[..., F64]) -> Interval:
    """Return a statistic of paired samples with its confidence interval."""
    value = float(statistic(*samples, axis=-1))
    if len(samples[0]) < 2:
        return Interval(value, None, None)
    # BCa is undefined if all resamples are equal; the percentile interval is then the value itself.
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
