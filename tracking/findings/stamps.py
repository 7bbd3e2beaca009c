"""Stamps of inertial samples against those of a steady sensor."""

from __future__ import annotations

import numpy as np

from tracking.findings.finding import Finding
from tracking.log.folder import Log
from tracking.log.inertial import FEW, LONG_GAP
from tracking.measurements import Kind

MOST_REPEATED = 0.01
"""[-] Largest share of samples with the time of their predecessor."""
MOST_JITTER = 0.2
"""[-] Largest scatter of times, in periods of the sensor."""


def find_bad_stamps(log: Log) -> list[Finding]:
    """Find nodes whose inertial samples have times that repeat or jitter."""
    block, found = log.block, list[Finding]()
    for n, node in enumerate(log.constellation.nodes):
        t = block.t[0, (block.kind[0] == Kind.IMU) & (block.i[0] == n)]
        if len(t) < FEW:
            continue
        dt, period = np.diff(t), 1.0 / node.imu_hz
        steps = np.round(dt / period)
        steady = dt < LONG_GAP * period
        # The difference of two times has the errors of both.
        jitter = float(np.std((dt - steps * period)[steady])) / np.sqrt(2.0)
        repeated = float(np.mean(dt <= 0.0))
        if repeated > MOST_REPEATED or jitter > MOST_JITTER * period:
            text = (
                f"node {node.id}: {repeated:.0%} of its IMU samples have the time of the one "
                f"before, times scatter by {1e3 * jitter:.1f} ms; expected when each was taken, "
                f"every {1e3 * period:.1f} ms"
            )
            found.append(Finding("bad-stamps", (node.id,), text))
    return found
