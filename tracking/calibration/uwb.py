"""Slope and antenna delays of UWB ranges, for all nodes at once, from true distances.

    range = a distance + b_i + b_j + n

NLOS ranges are too long and must not count: RANSAC [1] on the ranges of all pairs together,
each pair about its own centre (that of its densest band), finds the slope and the inliers.
Least squares over these, repeated until the inliers stay the same, gives a and every b; the
slope stays 1 if distances hardly change.

References:
    [1] Fischler, Bolles, Comm. ACM 24 (1981) 381.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tracking.arrays import F64, I64, Bool
from tracking.calibration.calibration import RangeCalibration
from tracking.calibration.distances import RangeTable
from tracking.calibration.errors import CalibrationError
from tracking.params.short_repr import short_repr


@dataclass(frozen=True, slots=True, kw_only=True)
class UwbParams:
    """Requirements of a range calibration."""

    max_distance: float = 8.0
    """[m] Largest distance used; the paper's calibration is valid up to it."""
    band: float = 0.3
    """[m] Half width of the initial inlier band; three to four times the noise."""
    min_ranges: int = 100
    """[-] Least number of ranges with truth over all pairs."""
    min_per_node: int = 20
    """[-] Least number of inliers of each node."""
    min_spread: float = 0.5
    """[m] Least standard deviation of distances within pairs for a slope."""
    min_inliers: float = 0.5
    """[-] Least share of inliers."""
    max_slope_error: float = 0.1
    """[-] Largest difference of the slope from 1; beyond, units or truth are wrong."""
    max_offset: float = 1.0
    """[m] Largest offset; beyond, the antenna delay is not set in the radio, or the truth is wrong.
    With few places of few nodes any such error fits exactly, so residuals do not show it."""


@dataclass(frozen=True, slots=True)
class UwbResult:
    """Range calibration of a group."""

    __repr__ = short_repr

    calibration: RangeCalibration
    slope_fitted: bool
    """False if distances spread too little; the slope is then 1."""
    slope_se: float
    """[-] Standard error of the slope for independent errors; 0 if it is not fitted."""
    separable: bool
    """False if only sums b_i + b_j are determined; the smallest offsets are then given."""
    residual_std: float
    """[m] Standard deviation of inliers after the fit."""
    distance: tuple[float, float]
    """[m] Least and largest true distance of inliers: the validity of the calibration."""
    used: Bool
    """Mask of ranges with truth, near enough and of nodes with enough of them, (range)."""
    inlier: Bool
    """Mask of inliers, (range)."""
    error_before: F64
    """Range minus true distance, (range) [m]; 0 if the truth is unknown."""
    error_after: F64
    """Range minus true distance after calibration, (range) [m]."""

    @property
    def inlier_share(self) -> float:
        """Share of inliers among used ranges [-]."""
        return float(self.inlier.sum() / self.used.sum())


def calibrate_uwb(
    table: RangeTable, ids: tuple[int, ...], *, random_state: int, params: UwbParams | None = None
) -> UwbResult:
    """Estimate slope and offsets.

    Args:
        table: Ranges with their true distances.
        ids: Node ids in array order.
        random_state: Seed of RANSAC.
        params: Requirements of the data.

    Raises:
        CalibrationError: No truth, too few ranges, or no common line through most of them.
    """
    p = params or UwbParams()
    used = _without_rare(table, table.known & (table.true <= p.max_distance) & (table.true > 0), p)
    while True:
        fit = _fit(table, used, len(ids), p, random_state)
        kept = _without_rare(table, used, p, agree=fit.inlier)
        if np.array_equal(kept, used):
            break
        used = kept
    if abs(fit.slope - 1.0) > p.max_slope_error:
        raise CalibrationError(
            f"a slope of {fit.slope:.3f}, expected {1 - p.max_slope_error:g} to "
            f"{1 + p.max_slope_error:g}: are ranges and truth in metres and on one clock?"
        )
    d, incidence = table.true[fit.inlier], fit.incidence
    nodes = np.nonzero(incidence.any(axis=0))[0]
    offset = {ids[n]: float(fit.offset[n]) for n in nodes}
    for node, b in offset.items():
        if abs(b) > p.max_offset:
            raise CalibrationError(
                f"node {node}: an offset of {b:.2f} m, expected within {p.max_offset:g} m: are the "
                "true places right, and is the antenna delay of its radio set?"
            )
    both = np.zeros(len(ids))
    both[nodes] = fit.offset[nodes]
    corrected = (table.measured - both[table.i] - both[table.j]) / fit.slope
    return UwbResult(
        calibration=RangeCalibration(slope=fit.slope, offset=offset),
        slope_fitted=fit.spread is not None,
        slope_se=0.0 if fit.spread is None else fit.std / fit.spread,
        separable=bool(np.linalg.matrix_rank(incidence) == len(nodes)),
        residual_std=fit.std,
        distance=(float(d.min()), float(d.max())),
        used=used,
        inlier=fit.inlier,
        error_before=np.where(table.known, table.measured - table.true, 0.0),
        error_after=np.where(table.known, corrected - table.true, 0.0),
    )


@dataclass(frozen=True, slots=True)
class _Fit:
    """One line for all pairs."""

    slope: float
    offset: F64
    """Offset of each node, (node) [m]."""
    inlier: Bool
    """Mask of inliers, (range)."""
    incidence: F64
    """The two nodes of every pair with inliers, (pair, node) of 0 and 1."""
    spread: float | None
    """[m] Root sum of squares of the distances that determine the slope; None if not fitted."""
    std: float
    """[m] Standard deviation of the residuals."""


def _fit(table: RangeTable, used: Bool, n_nodes: int, p: UwbParams, random_state: int) -> _Fit:
    """Fit inliers by least squares, until they stay the same."""
    d, z = table.true[used], table.measured[used]
    pair, incidence = _pairs(table.i[used], table.j[used], n_nodes)
    inlier, slope = _agree(d, z, pair, p, random_state)
    spread: float | None = None
    for _ in range(20):
        _check(inlier, p)
        column = incidence[pair[inlier]]
        free = d[inlier] - column @ np.linalg.lstsq(column, d[inlier])[0]
        if float(free.std()) >= p.min_spread:
            solution = np.linalg.lstsq(np.column_stack([d[inlier], column]), z[inlier])[0]
            slope, offset = float(solution[0]), solution[1:]
            spread = float(np.sqrt(np.sum(free**2)))
        else:
            slope, offset = 1.0, np.linalg.lstsq(column, z[inlier] - d[inlier])[0]
            spread = None
        residual = z - slope * d - incidence[pair] @ offset
        scale = 1.4826 * float(np.median(np.abs(residual[inlier])))
        now = np.abs(residual) <= min(max(3.5 * scale, 0.02), p.band)
        if np.array_equal(now, inlier):
            break
        inlier = now
    everywhere = np.zeros(len(used), dtype=bool)
    everywhere[used] = inlier
    present = incidence[np.unique(pair[inlier])]
    std = float(residual[inlier].std())
    return _Fit(slope, np.asarray(offset, dtype=np.float64), everywhere, present, spread, std)


def _without_rare(table: RangeTable, used: Bool, p: UwbParams, agree: Bool | None = None) -> Bool:
    """Return the used ranges without nodes that have too few, or too few inliers if given."""
    if not table.known.any():
        raise CalibrationError(
            "no range has a true distance, expected truth of both nodes at the ranges' times"
        )
    while True:
        n_used, n_agree = (
            np.bincount(np.concatenate([table.i[some], table.j[some]]), minlength=_last(table) + 1)
            for some in (used, used if agree is None else used & agree)
        )
        rare = np.nonzero((n_used > 0) & (n_agree < p.min_per_node))[0]
        if len(rare) == 0:
            break
        used = used & ~np.isin(table.i, rare) & ~np.isin(table.j, rare)
    if used.sum() < p.min_ranges:
        raise CalibrationError(
            f"{used.sum()} ranges have a true distance up to {p.max_distance:g} m and are of nodes "
            f"with {p.min_per_node} that agree, expected at least {p.min_ranges}"
        )
    return np.asarray(used)


def _last(table: RangeTable) -> int:
    """Return the largest node index."""
    return int(max(table.i.max(initial=0), table.j.max(initial=0)))


def _pairs(i: I64, j: I64, n_nodes: int) -> tuple[I64, F64]:
    """Return the pair of every range, (range), and the nodes of every pair, (pair, node)."""
    code, pair = np.unique(np.minimum(i, j) * n_nodes + np.maximum(i, j), return_inverse=True)
    incidence = np.zeros((len(code), n_nodes))
    rows = np.arange(len(code))
    incidence[rows, code // n_nodes] = incidence[rows, code % n_nodes] = 1.0
    return pair, incidence


def _agree(d: F64, z: F64, pair: I64, p: UwbParams, random_state: int) -> tuple[Bool, float]:
    """Return inliers of one line about the centres of all pairs, and its slope."""
    from sklearn.linear_model import LinearRegression, RANSACRegressor

    x, y = np.empty(len(d)), np.empty(len(d))
    for k in np.unique(pair):
        mine = pair == k
        dense = _densest(z[mine] - d[mine], p.band)
        x[mine] = d[mine] - d[mine][dense].mean()
        y[mine] = z[mine] - z[mine][dense].mean()
    ransac = RANSACRegressor(
        LinearRegression(),
        min_samples=4,
        residual_threshold=p.band,
        max_trials=500,
        random_state=random_state,
    )
    try:
        ransac.fit(x[:, None], y)
    except ValueError as error:
        raise CalibrationError("no line agrees with the ranges of all pairs") from error
    inlier = np.asarray(ransac.inlier_mask_, dtype=bool)
    return inlier, float(ransac.estimator_.coef_[0])


def _densest(values: F64, half: float) -> Bool:
    """Return a mask of the values in the densest band of width 2 half, (value)."""
    ordered = np.sort(values)
    stop = np.searchsorted(ordered, ordered + 2.0 * half, side="right")
    low = ordered[int(np.argmax(stop - np.arange(len(ordered))))]
    return np.asarray((values >= low) & (values <= low + 2.0 * half))


def _check(inlier: Bool, p: UwbParams) -> None:
    if inlier.mean() < p.min_inliers:
        raise CalibrationError(
            f"{100 * inlier.mean():.0f} % of the ranges agree within {p.band:g} m, expected at "
            f"least {100 * p.min_inliers:.0f} %: was the line of sight free, and are ranges and "
            "truth on one clock?"
        )
