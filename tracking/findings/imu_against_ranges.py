"""IMUs against ranges: ranges must be likelier with an IMU than without it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tracking.arrays import F64
from tracking.findings.finding import Finding
from tracking.findings.trials import (
    Progress,
    beginning,
    misfit,
    most_surprise,
    of_nodes,
    through,
)
from tracking.log.folder import Log
from tracking.measurements import Kind, MeasurementBlock

CONTRADICTS = 0.1
"""[-] Least gain in log-likelihood of a range, in both halves, without an IMU that is wrong.
Without an IMU that is right it falls by 0.05 to 0.3."""

AXES = {
    "y, -x": ((1, 0), (1, -1)),
    "-y, x": ((1, 0), (-1, 1)),
    "-x, -y": ((0, 1), (-1, -1)),
    "y, x": ((1, 0), (1, 1)),
    "-y, -x": ((1, 0), (-1, -1)),
    "-x, y": ((0, 1), (-1, 1)),
    "x, -y": ((0, 1), (1, -1)),
}
"""Trial columns x and y, with signs, of a sensor whose horizontal axes are wrong."""
SENSORS = {"accelerometer": (Kind.IMU, 3), "magnetometer": (Kind.MAG, 0)}
"""Sensors whose axes are tried, with their kind of event and first column."""
RADIANS = np.pi / 180.0


def find_suspects(log: Log, progress: Progress) -> dict[int, F64]:
    """Find nodes without whose IMU ranges are likelier, one after the other, the worst first.

    Returns:
        `Misfit.surprise` without the IMUs up to each node, by node.
    """
    if log.constellation.n_nodes < 3:
        return {}
    block, suspects = beginning(log), dict[int, F64]()
    carriers = np.unique(block.i[0, block.kind[0] == Kind.IMU]).tolist()
    cost = misfit(log, block).surprise
    while carriers:
        tried = through(carriers, len(suspects), progress)
        costs = [misfit(log, without(block, n)).surprise for n in tried]
        gains = [float((cost - bare).min()) for bare in costs]
        k = int(np.argmax(gains))
        if gains[k] < CONTRADICTS:
            break
        suspects[carriers[k]] = cost = costs[k]
        block = without(block, carriers.pop(k))
    return suspects if (cost < most_surprise(log)).all() else {}


def find_wrong_axes(log: Log, suspects: Sequence[int], progress: Progress) -> list[Finding]:
    """Find axes, or rates in deg/s, that explain IMUs which contradict the ranges."""
    block, found = beginning(log), list[Finding]()
    for n in through(suspects, 0, progress):
        bare = without(block, n)
        least, named = misfit(log, bare).surprise, ""
        cost = misfit(log, _in_radians(block, n)).surprise
        if (cost < least).all():
            least, named = cost, "its gyroscope were in deg/s"
        for sensor, (kind, column) in SENSORS.items():
            for axes, (order, signs) in AXES.items():
                turned = _turned(block, n, kind, column, order, signs)
                cost = misfit(log, turned).surprise
                if (cost < least).all():
                    least, named = cost, f"x, y of its {sensor} were {axes}"
        node = log.constellation.ids[n]
        text = f"node {node}: ranges are likelier without its IMU and magnetometer than with them"
        if named:
            text += f"; they are likeliest if {named}"
        found.append(Finding("imu-contradicts", (node,), text))
        block = bare
    return found


def without(block: MeasurementBlock, n: int) -> MeasurementBlock:
    """Return a block without the IMU and magnetometer of node n."""
    return block.take(~of_nodes(block, (n,)))


def _in_radians(block: MeasurementBlock, n: int) -> MeasurementBlock:
    values = block.values.copy()
    values[0, (block.kind[0] == Kind.IMU) & (block.i[0] == n), :3] *= RADIANS
    return replace(block, values=values)


def _turned(
    block: MeasurementBlock,
    n: int,
    kind: Kind,
    column: int,
    order: tuple[int, int],
    signs: tuple[int, int],
) -> MeasurementBlock:
    rows = np.flatnonzero((block.kind[0] == kind) & (block.i[0] == n))
    values = block.values.copy()
    values[0, rows, column : column + 2] = values[0, rows][:, [column + k for k in order]] * signs
    return replace(block, values=values)
