"""Degradations of a recorded run, each a function of the log.

    change(log, rng) -> log

Ground truth and the order of ranges are unchanged, so the labels of the log remain valid.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tracking.arrays import Bool
from tracking.log import Log
from tracking.measurements import Kind, MeasurementBlock

DROPOUT = 10.0
"""[s] Duration without IMU data of one node."""
CLOCK_OFFSET = 0.05
"""[s] Delay of the IMU time stamps of one node."""
HEADING_ERROR = np.radians(5.0)
"""[rad] Rotation of the magnetometer of one node about its z axis."""
OUTLIER_SHARE = 0.02
"""[-] Share of ranges that are outliers."""
OUTLIER_SPAN = 20.0
"""[m] Outliers are uniformly distributed between 0 and this."""


def without_powers(log: Log, rng: np.random.Generator) -> Log:
    """Remove received and first-path powers of ranges, as with radios that do not report them."""
    ranges = log.block.kind == Kind.RANGE
    values, has_power = log.block.values.copy(), log.block.has_power.copy()
    values[ranges, 1:] = 0.0
    has_power[ranges] = False
    return replace(log, block=replace(log.block, values=values, has_power=has_power))


def imu_dropout(log: Log, rng: np.random.Generator) -> Log:
    """Remove IMU and magnetometer of the first node for `DROPOUT` in the middle of the run."""
    first, last = log.t_range
    middle = 0.5 * (first + last)
    silent = np.abs(log.block.t[0] - middle) < 0.5 * DROPOUT
    return replace(log, block=log.block.take(~(silent & _inertial(log.block, 0))))


def clock_offset(log: Log, rng: np.random.Generator) -> Log:
    """Delay time stamps of the first node's IMU and magnetometer by `CLOCK_OFFSET`."""
    t = log.block.t.copy()
    t[0, _inertial(log.block, 0)] += CLOCK_OFFSET
    return replace(log, block=replace(log.block, t=t).sorted())


def heading_error(log: Log, rng: np.random.Generator) -> Log:
    """Rotate the magnetometer of the first node by `HEADING_ERROR` about its z axis."""
    mag = (log.block.kind[0] == Kind.MAG) & (log.block.i[0] == 0)
    c, s = np.cos(HEADING_ERROR), np.sin(HEADING_ERROR)
    R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])  # noqa: N806
    values = log.block.values.copy()
    values[0, mag, :3] = values[0, mag, :3] @ R.T
    return replace(log, block=replace(log.block, values=values))


def range_outliers(log: Log, rng: np.random.Generator) -> Log:
    """Replace the share `OUTLIER_SHARE` of ranges by values between 0 and `OUTLIER_SPAN`."""
    ranges = np.nonzero(log.block.kind[0] == Kind.RANGE)[0]
    hit = ranges[rng.random(len(ranges)) < OUTLIER_SHARE]
    values = log.block.values.copy()
    # 1 - random() is positive, as required of ranges.
    values[0, hit, 0] = OUTLIER_SPAN * (1.0 - rng.random(len(hit)))
    return replace(log, block=replace(log.block, values=values))


def _inertial(block: MeasurementBlock, node: int) -> Bool:
    """Return the mask of IMU and magnetometer events of a node, (event,)."""
    of_kind = np.isin(block.kind[0], (Kind.IMU, Kind.MAG))
    return np.asarray(of_kind & (block.i[0] == node))
