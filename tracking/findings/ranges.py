"""Ranges against each other and against surveyed distances: what calibration would take off."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from tracking.arrays import F64
from tracking.findings.finding import Finding
from tracking.findings.trials import lowest, misfit, parts_of
from tracking.log.folder import Log
from tracking.measurements import Kind

OFFSETS = np.array([-0.6, -0.4, -0.2, 0.0, 0.2, 0.4, 0.6])
"""[m] That all ranges may have in common."""
SCALES = np.array([-0.09, -0.06, -0.03, 0.0, 0.03, 0.06, 0.09])
"""[-] Relative errors of all ranges."""
LEAST_GAIN = 0.03
"""[-] By so much ranges have to fit better."""
TOLD_OFFSET, TOLD_SCALE = 0.1, 0.015
"""[m], [-] Smaller errors are not told apart from none."""


def find_range_errors(log: Log) -> list[Finding]:
    """A length, or a factor, that all ranges have too much."""
    parts, found = parts_of(log), list[Finding]()
    if log.constellation.n_nodes < 3:
        return found

    def changed(part: int, offset: float, scale: float) -> tuple[float, float]:
        values = parts[part].values.copy()
        is_range = parts[part].kind[0] == Kind.RANGE
        metres = (values[0, is_range, 0] - offset) / (1.0 + scale)
        values[0, is_range, 0] = np.maximum(metres, 0.01)
        cost, ok = misfit(log, replace(parts[part], values=values))
        # What is left over counts in the ranges' own metres, or shorter ranges always fit better.
        return cost * (1.0 + scale) ** 2, ok

    # Without an IMU pairs stay ambiguous, whatever ranges are like.
    often_ok = 0.3 if np.isin(log.block.kind[0], (Kind.IMU, Kind.STATE)).any() else 0.0
    offset = _found(lambda part, x: changed(part, x, 0.0), OFFSETS, often_ok)
    if abs(offset) > TOLD_OFFSET:
        way = "shorter" if offset > 0.0 else "longer"
        text = f"ranges of all pairs fit better when {abs(offset):.2f} m {way}"
        found.append(Finding("range-offset", (), text))
    if (log.block.kind[0] == Kind.SURVEY).any():
        scale = _found(lambda part, x: changed(part, 0.0, x), SCALES, often_ok)
        if abs(scale) > TOLD_SCALE:
            way = "shorter" if scale > 0.0 else "longer"
            text = f"ranges of all pairs fit better when {100 * abs(scale):.0f} % {way}"
            found.append(Finding("range-scale", (), text))
    return found


def _found(
    cost: Callable[[int, float], tuple[float, float]], trials: F64, often_ok: float
) -> float:
    found = lowest(cost, trials, LEAST_GAIN, often_ok)
    return found[0] if found is not None and found[1] else 0.0
