"""Error and consistency of a run over time, in bins common to all runs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tracking.arrays import F64, I64, Bool
from tracking.estimate import Status, TeamEstimate
from tracking.metrics.consistency import pair_nees
from tracking.metrics.score import errors_after
from tracking.params.short_repr import short_repr

BIN = 0.5
"""[s] Width of a bin."""
NIS_EDGES = np.linspace(0.0, 10.0, 41)
"""[-] Bin edges of the NIS; one additional bin counts larger values."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OverTime:
    """Metrics of a run over time; NaN for bins without data."""

    __repr__ = short_repr

    t: F64
    """[s] Centres of the bins, (bin,)."""
    error: F64
    """[m] Position error after one constant yaw, mean over pairs, (bin,)."""
    nees: F64
    """[-] NEES of the positions per dimension, mean over pairs, (bin,)."""
    nis_counts: I64
    """Number of ranges with a NIS in each bin of `NIS_EDGES`, and above, (len(NIS_EDGES),)."""


def over_time(
    estimate: TeamEstimate, truth_ij_w: F64, has_truth: Bool, yaw_rad: float, seconds: float
) -> OverTime:
    """Average errors, NEES and NIS of a run in bins.

    Args:
        estimate: Estimates of one run, arrays over (time, pair).
        truth_ij_w: True relative positions, (time, pair, 3) [m].
        has_truth: True where `truth_ij_w` is known, (time, pair).
        yaw_rad: Constant yaw that is removed from the errors [rad].
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
    """Return means over time and pairs in every bin, NaN if empty, (bin,)."""
    at = np.broadcast_to(bins[:, None], values.shape)[used]
    total = np.bincount(at, weights=values[used], minlength=n_bins)
    count = np.bincount(at, minlength=n_bins)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def _count_nis(estimate: TeamEstimate) -> I64:
    """Return the histogram of the NIS; repeated values count once."""
    nis = estimate.nis
    fresh = np.zeros(nis.shape, dtype=bool)
    fresh[1:] = (nis[1:] != nis[:-1]) & (nis[1:] > 0.0)
    counts, _ = np.histogram(nis[fresh], np.append(NIS_EDGES, np.inf))
    return counts.astype(np.int64)
