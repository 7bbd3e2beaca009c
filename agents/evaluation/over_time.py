"""Error and consistency of a run over time, in bins, so that runs can be laid over each other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tracking.arrays import F64, I64, Bool
from tracking.estimate import Status, TeamEstimate
from tracking.metrics.consistency import pair_nees
from tracking.metrics.score import errors_after
from tracking.params.short_repr import short_repr

BIN = 0.5
"""[s]"""
NIS_EDGES = np.linspace(0.0, 10.0, 41)
"""[-] Bins of the NIS; larger ones are counted in one more."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OverTime:
    """What a run looks like over time; NaN where nothing could be said."""

    __repr__ = short_repr

    t: F64
    """Middle of each bin, (bin) [s]."""
    error: F64
    """Position error after one constant yaw, mean over pairs, (bin) [m]."""
    nees: F64
    """Squared position error over its covariance and per dimension, mean over pairs, (bin) [-]."""
    nis_counts: I64
    """How many ranges had a NIS in each bin of `NIS_EDGES`, and beyond, (bin + 1)."""


def over_time(
    estimate: TeamEstimate, truth_ij_w: F64, has_truth: Bool, yaw_rad: float, seconds: float
) -> OverTime:
    """Take the means of a run.

    Args:
        estimate: Of one run, arrays over (time, pair).
        truth_ij_w: True relative positions, (time, pair, 3) [m].
        has_truth: Where they are known, (time, pair).
        yaw_rad: The constant yaw that is taken out of the errors [rad].
        seconds: Length of the run [s].
    """
    n_bins = max(round(seconds / BIN), 1)
    bins = np.minimum((estimate.t / BIN).astype(np.int64), n_bins - 1)
    known = has_truth & ~np.isin(estimate.status, (Status.ABSENT, Status.STARTING))
    off = errors_after(estimate, truth_ij_w, yaw_rad)
    error = np.linalg.norm(off[..., : estimate.constellation.dimensions], axis=-1)
    c, s = np.cos(yaw_rad), np.sin(yaw_rad)
    R_yaw = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])  # noqa: N806
    nees, has_nees = pair_nees(estimate, truth_ij_w @ R_yaw)
    return OverTime(
        t=BIN * (np.arange(n_bins, dtype=np.float64) + 0.5),
        error=_bin_means(bins, error, known, n_bins),
        nees=_bin_means(bins, nees, known & has_nees, n_bins),
        nis_counts=_count_nis(estimate),
    )


def _bin_means(bins: I64, values: F64, used: Bool, n_bins: int) -> F64:
    """Means over time and pairs in every bin, NaN where there is nothing, (bin)."""
    at = np.broadcast_to(bins[:, None], values.shape)[used]
    total = np.bincount(at, weights=values[used], minlength=n_bins)
    count = np.bincount(at, minlength=n_bins)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def _count_nis(estimate: TeamEstimate) -> I64:
    """Each NIS counts once, when it is first seen."""
    nis = estimate.nis
    fresh = np.zeros(nis.shape, dtype=bool)
    fresh[1:] = (nis[1:] != nis[:-1]) & (nis[1:] > 0.0)
    counts, _ = np.histogram(nis[fresh], np.append(NIS_EDGES, np.inf))
    return counts.astype(np.int64)
