"""Readings of an IMU at rest: gravity, upwards, of the right norm, and no rotation."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tracking.arrays import F64
from tracking.constellation import NodeConfig
from tracking.findings.finding import Finding
from tracking.geometry import GRAVITY
from tracking.log.folder import Log
from tracking.measurements import Kind
from tracking.vehicles import VEHICLES

WINDOW = 0.5
"""[s] Time over which the readings of a node at rest hardly change."""
FEWEST = 8
"""[-] Least samples in that time."""
STEADY_ACCEL = 0.02
"""[-] Scatter of accelerations at rest over their mean norm, for any unit."""
STEADY_GYRO = 0.05
"""[rad/s] Scatter of rates at rest; or a thirtieth of the largest rate, for any unit."""
MEANT = {"g": GRAVITY, "mg": 1e-3 * GRAVITY}
"""[m/s2] Units that accelerations are recorded in by mistake."""
MOST_LENGTH = 0.05
"""[-] Largest relative error of gravity after calibration."""
ABSURD_LENGTH = 0.3
"""[-] Relative error of gravity above which the unit is not m/s2."""
TILTED, OVERTURNED = np.radians(8.0), np.radians(45.0)
"""[rad] Angles between z and gravity: tilted, and another axis."""
MOST_BIAS = 0.035
"""[rad/s] Largest steady rate that is estimated as a bias (`RestParams.largest_bias`)."""

FASTEST = 35.0
"""[rad/s] Full scale of gyroscopes, 2000 deg/s."""
MOST_FASTEST = 0.02
"""[-] Largest share of readings beyond it, such as single wrong ones."""
LARGEST_BIAS = 0.2
"""[rad/s] Largest bias; a gyroscope beyond is broken, or in other units."""
MOST_AT_REST = 0.9
"""[-] Largest share of time at rest; above, rest cannot be distinguished from motion."""


@dataclass(frozen=True, slots=True)
class AtRest:
    """Means of one IMU over the time at rest."""

    seconds: float
    force: F64
    """Specific force as recorded, (3); without rest the mean of the run, of which only the norm is
    meaningful."""
    length: float
    rate: F64
    """Angular rate as recorded, (3)."""


def rest_of(t: F64, values: F64) -> AtRest:
    """Find the rest of an IMU by the small variation of its readings.

    Args:
        t: Times, (sample) [s].
        values: Angular rate and specific force, (sample, 6), in any unit.
    """
    start = np.searchsorted(t, np.arange(t[0], t[-1] - WINDOW, WINDOW))
    windows = [slice(a, b) for a, b in zip(start[:-1], start[1:], strict=True) if b - a >= FEWEST]
    size = np.linalg.norm(values[:, 3:], axis=1)
    steady = max(STEADY_GYRO, float(np.quantile(np.abs(values[:, :3]), 0.99)) / 30.0)
    rests = [
        w
        for w in windows
        if values[w, :3].std(axis=0).max() < steady
        and values[w, 3:].std(axis=0).max() < STEADY_ACCEL * size[w].mean()
    ]
    if not rests:
        return AtRest(0.0, values[:, 3:].mean(axis=0), float(np.median(size)), np.zeros(3))
    means = np.array([values[w].mean(axis=0) for w in rests])
    # A steady curve reads as steadily as rest: the windows with the least rotation are rest.
    rest = np.median(means[np.argsort(np.linalg.norm(means[:, :3], axis=1))[:3]], axis=0)
    return AtRest(WINDOW * len(rests), rest[3:], float(np.linalg.norm(rest[3:])), rest[:3])


def is_bias(rest: AtRest, seconds: float) -> bool:
    """Return whether a rate at rest is a bias, not a steady rotation of the node.

    Args:
        rest: Means of an IMU at rest.
        seconds: Length of its samples [s].
    """
    return bool(np.abs(rest.rate).max() < LARGEST_BIAS and rest.seconds < MOST_AT_REST * seconds)


def correct_at_rest(log: Log) -> tuple[Log, list[Finding]]:
    """Check units, axes and biases of every IMU of a recording.

    Returns:
        The log with large gyroscope biases subtracted, and the findings.
    """
    found, block = list[Finding](), log.block
    for n, node in enumerate(log.constellation.nodes):
        rows = np.flatnonzero((block.kind[0] == Kind.IMU) & (block.i[0] == n) & block.valid[0])
        of_node = find_in_samples(node, block.t[0, rows], block.values[0, rows, :6])
        for f in of_node:
            said = ""
            if f.name == "gyro-bias":
                rest = rest_of(block.t[0, rows], block.values[0, rows, :6])
                said = "; kept, as it may be a rotation"
                if is_bias(rest, float(np.ptp(block.t[0, rows]))):
                    said = "; subtracted"
                    values = block.values.copy()
                    values[0, rows, :3] -= rest.rate
                    block = replace(block, values=values)
            found.append(replace(f, text=f.text + said))
    return (log if block is log.block else replace(log, block=block)), found


def find_in_samples(node: NodeConfig, t: F64, values: F64) -> list[Finding]:
    """Check units, axes and biases of one IMU.

    Args:
        node: Node of the IMU.
        t: Times, (sample) [s].
        values: Recorded angular rate and specific force, (sample, 6).
    """
    if len(t) < 4 * FEWEST or t[-1] - t[0] < 2.0 * WINDOW:
        return []
    is_fast = np.abs(values[:, :3]).max(axis=1) > FASTEST
    if is_fast.mean() > MOST_FASTEST:
        text = (
            f"node {node.id}: {is_fast.mean():.0%} of gyr_x, gyr_y, gyr_z are beyond "
            f"{FASTEST:.0f} rad/s (2000 deg/s), expected rad/s; they may be in deg/s"
        )
        return [Finding("gyro-units", (node.id,), text)]
    rest, found = rest_of(t, values), list[Finding]()
    if not rest.seconds:
        text = f"node {node.id} never rests: the bias of its gyroscope is not known at first"
        found.append(Finding("never-still", (node.id,), text))
    found += _of_gravity(node, rest)
    if np.abs(rest.rate).max() > MOST_BIAS:
        rate = ", ".join(f"{v:.3f}" for v in rest.rate)
        text = f"node {node.id}: gyr_x, gyr_y, gyr_z at rest are {rate}, expected 0 rad/s"
        found.append(Finding("gyro-bias", (node.id,), text))
    return found


def _of_gravity(node: NodeConfig, rest: AtRest) -> list[Finding]:
    length = rest.length
    where = "at rest" if rest.seconds else "in the middle of the run"
    said = f"node {node.id}: accelerations are {length:.3g} {where}, expected 9.81 m/s2"
    for unit, meant in MEANT.items():
        if abs(length * meant / GRAVITY - 1.0) < ABSURD_LENGTH:
            return [Finding("accel-units", (node.id,), f"{said}; they seem to be in {unit}")]
    off = abs(length / GRAVITY - 1.0)
    if off > (ABSURD_LENGTH if rest.seconds else 2.0 * ABSURD_LENGTH):
        return [Finding("accel-units", (node.id,), said)]
    if not rest.seconds:
        return []
    found = [Finding("gravity-length", (node.id,), said)] if off > MOST_LENGTH else []
    if not VEHICLES[node.vehicle].levelled:
        return found
    tilt = np.arccos(np.clip(rest.force[2] / length, -1.0, 1.0))
    axis = int(np.argmax(np.abs(rest.force)))
    name = ("-" if rest.force[axis] < 0.0 else "+") + "xyz"[axis]
    force = ", ".join(f"{v:.2f}" for v in rest.force)
    said = f"node {node.id}: acc_x, acc_y, acc_z at rest are {force}"
    if tilt > OVERTURNED:
        text = (
            f"{said}: gravity is on {name}, expected on +z of a {node.vehicle}, which stays level"
        )
        found.append(Finding("gravity-axis", (node.id,), text))
    elif tilt > TILTED:
        text = f"{said}: tilted by {np.degrees(tilt):.0f} degrees, expected 0"
        found.append(Finding("gravity-tilt", (node.id,), text))
    return found
