"""Export of the measurements of a live run as a log folder for `relpos track`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from hardware_bridge.errors import BridgeError
from hardware_bridge.exports.whole import whole_folder
from tracking.arrays import Bool
from tracking.constellation import Constellation
from tracking.errors import LogError
from tracking.log import Log, read_log, write_log
from tracking.log.read import MAX_ACC, MAX_GYR, MAX_MAG
from tracking.measurements import Kind, MeasurementBlock
from tracking.sanity.measurements import FARTHEST

N_COLUMNS = 7
"""Number of value columns of a log; the tracker computes the eighth again."""
_LIMITS = {
    Kind.MAG: np.array([MAX_MAG] * 3),
    Kind.IMU: np.array([MAX_GYR] * 3 + [MAX_ACC] * 3),
    Kind.STATE: np.array([1.1] * 4 + [MAX_ACC] * 3),
}


def export_log(
    folder: Path | str,
    block: MeasurementBlock,
    constellation: Constellation,
    *,
    name: str,
    source: str = "",
) -> dict[str, int]:
    """Write measurements as a log, and read it back to verify it.

    Invalid events are left out, as `read_log` would: ranges not above 0 or above 300 m, values
    beyond the scale of any sensor, and inertial samples of static nodes.

    Args:
        folder: New or empty folder.
        block: Measurements of one environment, in any order.
        constellation: Nodes of the run.
        name: Name of the run.
        source: Origin of the run.

    Returns:
        Number of events left out, by kind, such as ``{"RANGE": 3}``.

    Raises:
        BridgeError: The folder is not empty, or the run makes no valid log: it has no range, or a
            magnetic heading without a magnetometer.
    """
    if block.n_envs != 1:
        raise BridgeError(f"block: expected one environment, got {block.n_envs}")
    block = block.env(0)
    good = _fits(block, constellation)
    left_out = {
        kind.name: n for kind in Kind if (n := int(np.sum((block.kind[0] == kind) & ~good)))
    }
    kept = block.take(good).sorted()
    kept = replace(
        kept,
        values=kept.values[:, :, :N_COLUMNS],
        has_power=kept.has_power & np.isfinite(kept.values[:, :, 1:3]).all(axis=2),
    )
    if not kept.count(Kind.RANGE):
        raise BridgeError(f"{folder}: the run has no range, and a log needs one")
    with whole_folder(folder) as scratch:
        try:
            log = Log(name=name, constellation=constellation, block=kept, source=source)
            write_log(scratch, log)
            read_log(scratch)
        except LogError as error:
            raise BridgeError(f"{folder}: the run makes no log: {error}") from error
    return left_out


def _fits(block: MeasurementBlock, constellation: Constellation) -> Bool:
    """Return the mask of events that a log can hold, (event)."""
    kind, values, i, j = block.kind[0], block.values[0], block.i[0], block.j[0]
    good = np.isin(kind, (Kind.JOIN, Kind.LEAVE))
    static = constellation.is_static
    with np.errstate(invalid="ignore"):
        ranged = (values[:, 0] > 0.0) & (values[:, 0] <= FARTHEST) & (i != j)
        good |= (kind == Kind.RANGE) & ranged
        good |= (kind == Kind.SURVEY) & ranged & static[i] & static[j]
        for one, limits in _LIMITS.items():
            within = (np.abs(values[:, : len(limits)]) <= limits).all(axis=1)
            if one == Kind.STATE:
                within &= np.abs(np.linalg.norm(values[:, :4], axis=1) - 1.0) < 0.05
            good |= (kind == one) & within & ~static[i]
    return np.asarray(good & np.isfinite(block.t[0]))
