"""Magnetometers that are turned about the vertical: ranges show where a node drives.

Neither gravity nor the gyroscope of a vehicle that stays level shows such a turn. The acceleration
of the node then points in a wrong direction, and ranges are less likely.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tracking.arrays import F64
from tracking.findings.finding import Finding
from tracking.findings.trials import (
    Explained,
    Progress,
    beginning,
    best,
    misfit,
    most_surprise,
    of_nodes,
    through,
)
from tracking.log.folder import Log
from tracking.measurements import Kind, MeasurementBlock
from tracking.vehicles import VEHICLES

TURNS = np.radians([-80.0, -60.0, -40.0, -20.0, 0.0, 20.0, 40.0, 60.0, 80.0])
"""[rad] Trial turns of each magnetometer."""
LEAST_GAIN = 0.01
"""[-] Least gain in log-likelihood of a range."""
NEGLIGIBLE = np.radians(10.0)
"""[rad] Largest turn that counts as none: a heading error that the filter estimates."""
FEWEST_NODES, MOST_NODES = 3, 8
"""[-] Fewest and most nodes with an IMU and a magnetometer that are compared."""


def correct_magnetometers(log: Log, progress: Progress) -> tuple[Log, list[Finding]]:
    """Find magnetometers of level vehicles that are turned, and turn their readings back.

    The one with the largest gain is corrected first.

    Args:
        log: A recording.
        progress: Called with the completed share, 0 to 1.

    Returns:
        The log with the corrections, and the findings.
    """
    group = log.constellation
    kind, node = log.block.kind[0], log.block.i[0]
    measured = np.intersect1d(node[kind == Kind.MAG], node[kind == Kind.IMU]).tolist()
    if not FEWEST_NODES <= len(measured) <= MOST_NODES or group.heading != "magnetic":
        return log, []
    left = [n for n in measured if VEHICLES[group.nodes[n].vehicle].levelled]
    found = list[Finding]()
    while left:
        tried = [_turn(log, n) for n in through(left, len(found), progress)]
        gains = [0.0 if one is None else one.gain for one in tried]
        n, turn = left[int(np.argmax(gains))], tried[int(np.argmax(gains))]
        if turn is None:
            break
        own, way = group.ids[n], "left" if turn.at > 0.0 else "right"
        said = f"node {own}: against those of the others its magnetometer is turned to the {way} by"
        angle = f"{abs(np.degrees(turn.at)):.0f} degrees"
        found.append(Finding("mag-turned", (own,), f"{said} about {angle}, corrected"))
        log = replace(log, block=turned(log.block, n, turn.at))
        left.remove(n)
    return log, found


def _turn(log: Log, n: int) -> Explained | None:
    """Estimate the turn of the magnetometer of node n [rad]; None if there is hardly any.

    An optimum at the ends of the trials is none: badly calibrated ranges make such ones likely.
    """
    block = beginning(log)

    def cost(turn: float) -> F64:
        return misfit(log, turned(block, n, turn)).surprise

    found = best(cost, TURNS, LEAST_GAIN, most_surprise(log))
    if found is None or not found.is_within or abs(found.at) <= NEGLIGIBLE:
        return None
    return found


def turned(block: MeasurementBlock, n: int, turn: float) -> MeasurementBlock:
    """Return a block with the readings of a magnetometer turned to the left [rad].

    A magnetometer that is turned to the right reads such a field.
    """
    rows = np.flatnonzero(of_nodes(block, (n,)) & (block.kind[0] == Kind.MAG))
    values, (c, s) = block.values.copy(), (np.cos(turn), np.sin(turn))
    x, y = block.values[0, rows, 0], block.values[0, rows, 1]
    values[0, rows, 0], values[0, rows, 1] = c * x - s * y, s * x + c * y
    return replace(block, values=values)
