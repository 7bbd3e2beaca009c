"""Slope and antenna delays of UWB ranges, for all nodes at once, against truth.

    range = a distance + b_i + b_j + n

Ranges behind an obstacle are too long and must not count: RANSAC [1] on the ranges of all
pairs together, each pair about its own centre (that of its densest band), finds the slope and
which ranges agree. Least squares over these, repeated until the same ranges agree, gives a
and every b; a slope of ranges that hardly change in distance stays 1.

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
    """What a calibration of ranges asks of its data."""

    max_distance: float = 8.0
    """[m] Farther ranges are not used; the paper's calibration holds up to here."""
    band: float = 0.3
    """[m] Half width of the band of ranges that agree at first; three to four times the noise."""
    min_ranges: int = 100
    """[-] Over all pairs, with truth."""
    min_per_node: int = 20
    """[-] Agreeing ranges that each node needs."""
    min_spread: float = 0.5
    """[m] Standard deviation of distances within pairs that a slope needs."""
    min_inliers: float = 0.5
    """[-] Share of ranges that must agree."""
    max_slope_error: float = 0.1
    """[-] A slope farther from 1 is a mistake of units or of the truth."""
    max_offset: float = 1.0
    """[m] A larger offset is a delay that the radio was never told, or a mistake of the truth. Few
    places of few nodes fit any mistake exactly, so that the residuals do not tell."""


@dataclass(frozen=True, slots=True)
class UwbResult:
    """The ranges of a group, calibrated."""

    __repr__ = short_repr

    calibration: RangeCalibration
    slope_fitted: bool
    """False where distances spread too little and the slope was left at 1."""
    slope_se: float
    """[-] Standard error of the slope for independent errors; 0 where not fitted."""
    separable: bool
    """False where only sums b_i + b_j are known, and were split in the smallest offsets."""
    residual_std: float
    """[m] Of the agreeing ranges after the fit."""
    distance: tuple[float, float]
    """[m] Least and largest true distance of agreeing ranges: where the calibration holds."""
    used: Bool
    """Ranges with truth, near enough and of a node with enough of them, (range)."""
    inlier: Bool
    """Those that agree, (range)."""
    error_before: F64
    """Range minus true distance, (range) [m]; 0 where the truth is not known."""
    error_after: F64
    """The same after calibration, (range) [m]."""

    @property
    def inlier_share(self) -> float:
        """Share of used ranges that agree [-]."""
        return float(self.inlier.sum() / self.used.sum())


def calibrate_uwb(
    table: RangeTable, ids: tuple[int, ...], *, random_state: int, params: UwbParams | None = None
) -> UwbResult:
    """Find slope and offsets.

    Args:
        table: Ranges next to their true distances.
        ids: Node ids in array order.
        random_state: Seed of RANSAC.
        params: What is asked of the data.

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
    """A line for all pairs at once."""

    slope: float
    offset: F64
    """(node) [m]"""
    inlier: Bool
    """Ranges that agree, (range)."""
    incidence: F64
    """The two nodes of every pair with such ranges, (pair, node) of 0 and 1."""
    spread: float | None
    """[m] Root of the sum of squares of what the slope was found from; None where it was not."""
    std: float
    """[m] Of what is left."""


def _fit(table: RangeTable, used: Bool, n_nodes: int, p: UwbParams, random_state: int) -> _Fit:
    """Least squares on the ranges that agree, until these are the same."""
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
    """Ranges to fit without those of nodes that have too few, of all or of those that agree."""
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
    """The greatest node, in array order."""
    return int(max(table.i.max(initial=0), table.j.max(initial=0)))


def _pairs(i: I64, j: I64, n_nodes: int) -> tuple[I64, F64]:
    """Pair of every range, (range), and the two nodes of every pair, (pair, node) of 0 and 1."""
    code, pair = np.unique(np.minimum(i, j) * n_nodes + np.maximum(i, j), return_inverse=True)
    incidence = np.zeros((len(code), n_nodes))
    rows = np.arange(len(code))
    incidence[rows, code // n_nodes] = incidence[rows, code % n_nodes] = 1.0
    return pair, incidence


def _agree(d: F64, z: F64, pair: I64, p: UwbParams, random_state: int) -> tuple[Bool, float]:
    """Ranges that agree with one line about the centres of their pairs, and its slope."""
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
    """The values in the band of width 2 half that holds most of them, (value)."""
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
