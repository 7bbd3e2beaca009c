"""Range errors of a recording, measured against its truth.

The error of a range is white noise and correlated parts, which change with the distance that both
ends travel (`tracking.filters.joint.params.RangeErrorParams`). The variogram, half the mean square
of differences over the distance travelled between, shows the size of each,

    gamma(s) = white^2 + fast^2 (1 - exp(-s / fast_length)) + slow^2 (1 - exp(-s / slow_length)).

The median of differences is used in place of their squares [1], so that a few NLOS ranges do not
outweigh all others: the result is the noise of LOS ranges. Differences do not contain the constant
error of a pair.

References:
    [1] Dowd, The variogram and kriging: robust and resistant estimators, Geostatistics for Natural
        Resources Characterization (1984) 91.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tracking.arrays import F64
from tracking.calibration.distances import range_table
from tracking.errors import LogError
from tracking.filters.joint.params import RangeErrorParams
from tracking.log import Log
from tracking.params.short_repr import short_repr

EDGES = np.concatenate([[0.0], np.geomspace(0.005, 12.0, 19)])
"""[m] Bin edges of the distance travelled between two ranges of a pair."""
LAGS = np.unique(np.geomspace(1, 3000, 40).astype(np.int64))
"""Lags between two ranges of a pair, in ranges."""
ENOUGH, FEWEST = 100, 5
"""Least number of differences in a bin, and least number of bins."""
FAST_LENGTHS, SLOW_LENGTHS = np.geomspace(0.05, 1.0, 14), np.geomspace(0.5, 12.0, 16)
"""[m] Trial correlation lengths."""
APART = 2.0
"""[-] Least ratio of the slow to the fast length."""
NORMAL = 1.4826
"""[-] Standard deviation of Gaussian numbers over the median of their magnitudes."""
LEAST_STD = 0.002
"""[m] Least standard deviation of a part."""
STEP = 0.05
"""[s] Step of the travelled distance, to which the jitter of the truth adds little."""


@dataclass(frozen=True, slots=True)
class Variogram:
    """Half the mean squared differences between the errors of two ranges of a pair."""

    __repr__ = short_repr

    way: F64
    """Mean distance travelled by both ends between the two ranges, (bin) [m]."""
    gamma: F64
    """Variogram, (bin) [m2]."""
    n: F64
    """Number of differences, (bin)."""


def measure_range_errors(log: Log, like: RangeErrorParams | None = None) -> RangeErrorParams:
    """Estimate the noise of the ranges of a recording.

    Args:
        log: A recording with truth; ranges labelled NLOS are not used.
        like: Source of the parameters that are not measured.

    Raises:
        LogError: There is no truth, or too little motion to separate the parts.
    """
    from scipy.optimize import nnls

    found = range_variogram(log)
    weight = np.sqrt(found.n / found.n.max()) / found.gamma
    best, least = (0.0, 0.0, 0.0, 0.0, 0.0), np.inf
    for fast_length in FAST_LENGTHS:
        for slow_length in SLOW_LENGTHS:
            if slow_length < APART * fast_length:
                continue
            stays = [1.0 - np.exp(-found.way / length) for length in (fast_length, slow_length)]
            parts = np.stack([np.ones_like(found.way), *stays], axis=1)
            share, misfit = nnls(parts * weight[:, None], found.gamma * weight)
            if misfit < least:
                least = misfit
                best = (*np.sqrt(share), fast_length, slow_length)
    white, fast, slow, fast_length, slow_length = (float(v) for v in best)
    return replace(
        like or RangeErrorParams(),
        white_std=max(white, LEAST_STD),
        fast_std=max(fast, LEAST_STD),
        slow_std=max(slow, LEAST_STD),
        fast_length=fast_length,
        slow_length=slow_length,
    )


def range_variogram(log: Log) -> Variogram:
    """Return the variogram of range errors over the distance travelled.

    Raises:
        LogError: There is no truth, or too little of it.
    """
    if len(log.truth.t) == 0:
        raise LogError("truth: expected a log with truth, errors of ranges are taken against it")
    table = range_table(log.block, log.constellation, log.truth)
    error, known = table.measured - table.true, table.known
    if log.nlos is not None:
        known = known & ~log.nlos
    way = _ways(log, table.t)
    first, second = np.minimum(table.i, table.j), np.maximum(table.i, table.j)
    ways, sizes = [np.empty(0)], [np.empty(0)]
    for a, b in log.constellation.pairs:
        of = np.nonzero((first == a) & (second == b) & known)[0]
        for lag in LAGS[len(of) > LAGS]:
            one, other = of[:-lag], of[lag:]
            ways.append((way[other][:, [a, b]] - way[one][:, [a, b]]).sum(axis=1))
            sizes.append(np.abs(error[other] - error[one]))
    travelled, apart = np.concatenate(ways), np.concatenate(sizes)
    at = np.digitize(travelled, EDGES) - 1
    bins = [b for b in range(len(EDGES) - 1) if int((at == b).sum()) >= ENOUGH]
    if len(bins) < FEWEST:
        raise LogError(
            f"ranges: expected pairs with truth that move while they range, "
            f"so that what stays shows; got {len(bins)} of {FEWEST} ways between ranges"
        )
    return Variogram(
        way=np.array([travelled[at == b].mean() for b in bins]),
        gamma=np.array(
            [max(0.5 * (NORMAL * np.median(apart[at == b])) ** 2, LEAST_STD**2) for b in bins]
        ),
        n=np.array([float((at == b).sum()) for b in bins]),
    )


def _ways(log: Log, t: F64) -> F64:
    """Return the distance that each node has travelled by some times, (time, node) [m]."""
    grid = np.arange(t[0], t[-1] + STEP, STEP)
    pos, known = log.truth.positions(log.constellation, grid)
    steps = np.linalg.norm(np.diff(pos, axis=0), axis=2)
    steps[~(known[1:] & known[:-1])] = 0.0
    ways = np.concatenate([np.zeros((1, steps.shape[1])), np.cumsum(steps, axis=0)])
    return np.stack([np.interp(t, grid, ways[:, k]) for k in range(ways.shape[1])], axis=1)
