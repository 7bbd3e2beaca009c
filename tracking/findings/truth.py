"""Truth against measured ranges: its clock, its unit, and which node is which."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np

from tracking.arrays import F64, I64
from tracking.findings.finding import Finding, names
from tracking.log.folder import Log
from tracking.measurements import Kind

MOST_RANGES = 3000
"""[-] Number of ranges that are compared, evenly chosen."""
SHIFTS = np.arange(-40, 41) / 10.0
"""[s] Trial delays of the truth."""
FEWEST = 20
"""[-] Least number of ranges of a pair with truth."""
LARGEST = 2.0
"""[m] Limit of the residual of a range, for outliers."""
LEAST_FACTOR = 0.08
"""[-] Relative error of a factor that is reported; multipath makes up to 0.07 of recordings."""
LEAST_SPREAD, TRIMS = 0.3, 4
"""[-] Least range of true distances over the largest, to know a factor; rounds without outliers."""
CLEARLY = 0.8
"""[-] Residuals over those of the truth as it is, below which another fits clearly better."""


def find_truth_errors(log: Log) -> list[Finding]:
    """Find a truth that is on another clock than the ranges, of other nodes, or scaled."""
    truth, t = log.truth, log.block.t[0]
    moving = ~log.constellation.is_static
    times = truth.t[truth.valid & moving[truth.node]]
    if not len(times) or not len(t):
        return []
    if times.min() > t.max() or times.max() < t.min():
        text = (
            f"truth is from {times.min():.1f} to {times.max():.1f} s, measurements are from "
            f"{t.min():.1f} to {t.max():.1f} s: no time in common, so nothing is scored"
        )
        return [Finding("truth-clock", (), text)]
    return _late(log) or _exchanged(log) or _scaled(log)


def _late(log: Log) -> list[Finding]:
    """Find a truth that fits ranges better at other times."""
    scatter = np.array([_scatter(_residuals(log, shift)) for shift in SHIFTS])
    now = scatter[SHIFTS == 0.0][0]
    k = int(np.argmin(np.where(np.isfinite(scatter), scatter, np.inf)))
    if not scatter[k] < CLEARLY * now:
        return []
    way = "later" if SHIFTS[k] > 0.0 else "earlier"
    text = (
        f"the motion of the truth comes {abs(SHIFTS[k]):.1f} s {way} than that of the ranges, "
        f"expected one clock: ranges scatter by {now:.2f} m about it, by {scatter[k]:.2f} m then"
    )
    return [Finding("truth-clock", (), text)]


def _exchanged(log: Log) -> list[Finding]:
    """Find two nodes whose truth fits ranges better if it is exchanged."""
    found, least, own = list[Finding](), CLEARLY, log.truth.node
    for a, b in combinations(np.unique(own).tolist(), 2):
        node = np.where(own == a, b, np.where(own == b, a, own))
        other = replace(log, truth=replace(log.truth, node=node))
        now, then = _distances(_residuals(log), _residuals(other))
        if then < least * now:
            least, ids = then / now, (log.constellation.ids[a], log.constellation.ids[b])
            text = (
                f"ranges are {now:.2f} m from the truth, {then:.2f} m if that of {names(ids)} is "
                "exchanged"
            )
            found = [Finding("truth-nodes", ids, text)]
    return found


def _scaled(log: Log) -> list[Finding]:
    """Find a factor between ranges and true distances; an offset has no part in it."""
    off, _, metres = _residuals(log)
    known = np.isfinite(off)
    distance, metres = (metres - off)[known], metres[known]
    if len(metres) < FEWEST or np.ptp(distance) < LEAST_SPREAD * distance.max():
        return []
    fits = np.ones(len(metres), dtype=bool)
    for _ in range(TRIMS):
        slope, intercept = np.polyfit(distance[fits], metres[fits], 1)
        rest = np.abs(metres - slope * distance - intercept)
        fits = rest <= 3.0 * np.median(rest)
    if abs(slope - 1.0) <= LEAST_FACTOR:
        return []
    text = (
        f"ranges grow by {slope:.3g} m for a metre of true distance, expected 1: they are long or "
        "short by a factor, or one of both is in another unit"
    )
    return [Finding("truth-scale", (), text)]


def _residuals(log: Log, shift: float = 0.0) -> tuple[F64, I64, F64]:
    """Return ranges less true distances, the number of their pair, and the ranges.

    Args:
        log: A recording with truth.
        shift: Delay of the truth [s].

    Returns:
        Residuals, NaN without truth, (range) [m]; numbers of the pairs, (range); ranges [m].
    """
    block = log.block
    rows = np.flatnonzero((block.kind[0] == Kind.RANGE) & block.valid[0])
    rows = rows[:: max(len(rows) // MOST_RANGES, 1)]
    pos, known = log.truth.positions(log.constellation, block.t[0, rows] + shift)
    i, j, k = block.i[0, rows], block.j[0, rows], np.arange(len(rows))
    metres = block.values[0, rows, 0]
    off = metres - np.linalg.norm(pos[k, i] - pos[k, j], axis=-1)
    off[~(known[k, i] & known[k, j])] = np.nan
    return off, i * log.constellation.n_nodes + j, metres


def _scatter(residuals: tuple[F64, I64, F64]) -> float:
    """Return the median absolute deviation of ranges from the median of their pair [m]."""
    off, pair = (of[np.isfinite(residuals[0])] for of in residuals[:2])
    of_pairs = [off[pair == p] for p in np.unique(pair)]
    rest = [np.abs(of - np.median(of)) for of in of_pairs if len(of) >= FEWEST]
    return float(np.median(np.concatenate(rest))) if rest else np.nan


def _distances(*residuals: tuple[F64, I64, F64]) -> F64:
    """Return mean absolute residuals of the ranges that all have, at most `LARGEST` each [m]."""
    off = np.array([of[0] for of in residuals])
    off = off[:, np.isfinite(off).all(axis=0)]
    if off.shape[1] < FEWEST:
        return np.full(len(off), np.nan)
    return np.asarray(np.minimum(np.abs(off), LARGEST).mean(axis=1))
