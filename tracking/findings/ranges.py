"""Common errors of ranges, which calibration would remove."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tracking.arrays import F64
from tracking.findings.finding import Finding
from tracking.findings.trials import (
    Progress,
    beginning,
    best,
    misfit,
    most_surprise,
    params_of,
)
from tracking.log.folder import Log
from tracking.measurements import Kind

OFFSETS = np.array([-0.6, -0.4, -0.2, 0.0, 0.2, 0.4, 0.6])
"""[m] Trial offsets of all ranges."""
SCALES = np.array([-0.09, -0.06, -0.03, 0.0, 0.03, 0.06, 0.09])
"""[-] Trial relative errors of all ranges."""
LEAST_GAIN = 0.01
"""[-] Least gain in log-likelihood of a range."""
NEGLIGIBLE_OFFSET, NEGLIGIBLE_SCALE = 0.1, 0.015
"""[m], [-] Largest offset and relative error that count as none."""


def find_range_errors(log: Log, progress: Progress) -> list[Finding]:
    """Find an offset or a factor that all ranges have in common."""
    if log.constellation.n_nodes < 3:
        return []
    block = beginning(log)
    is_range = block.kind[0] == Kind.RANGE

    def cost(offset: float, scale: float) -> F64:
        values = block.values.copy()
        metres = (values[0, is_range, 0] - offset) / (1.0 + scale)
        values[0, is_range, 0] = np.maximum(metres, 0.01)
        # The likelihood of ranges as recorded: their noise shrinks with them.
        params = params_of(log)
        error = params.range_error
        error = replace(error, white_std=error.white_std / (1.0 + scale))
        params = replace(params, range_error=error)
        found = misfit(log, replace(block, values=values), params)
        # Both are needed: NLOS excesses make long ranges likely, and the NIS leaves outliers out.
        return np.concatenate([found.surprise + np.log1p(scale), 0.5 * found.nis])

    progress(0.0)
    offset = best(lambda x: cost(x, 0.0), OFFSETS, LEAST_GAIN, most_surprise(log))
    progress(0.5)
    # Motion determines a factor only badly.
    is_surveyed = (log.block.kind[0] == Kind.SURVEY).any()
    scale = None
    if is_surveyed:
        scale = best(lambda x: cost(0.0, x), SCALES, LEAST_GAIN, most_surprise(log))
    found = list[Finding]()
    if offset is not None and abs(offset.at) > NEGLIGIBLE_OFFSET:
        way = "shorter" if offset.at > 0.0 else "longer"
        text = f"ranges of all pairs fit better when {abs(offset.at):.2f} m {way}"
        found.append(Finding("range-offset", (), text))
    if scale is not None and abs(scale.at) > NEGLIGIBLE_SCALE:
        way = "shorter" if scale.at > 0.0 else "longer"
        text = f"ranges of all pairs fit better when {100 * abs(scale.at):.0f} % {way}"
        found.append(Finding("range-scale", (), text))
    return found
