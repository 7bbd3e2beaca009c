"""Gyroscope against the magnetometer of the same node: both must measure the same rotation.

A uniform field turns in the body as the body turns in the world, ``dm/dt = -w x m``. Rates in
another unit, or axes that differ, contradict this; alternatives are tried: units, signs and
permutations of the magnetometer's axes.
"""

from __future__ import annotations

from itertools import permutations, product

import numpy as np

from tracking.arrays import F64
from tracking.findings.finding import Finding
from tracking.log.folder import Log
from tracking.measurements import Kind

STEP = 0.2
"""[s] Interval over which changes of the field are taken."""
FEWEST = 50
"""[-] Least number of such changes."""
TURNS = 0.05
"""[-] Least RMS change over the RMS field; below it the field does not turn."""
FITS, FITS_NOT = 0.7, 0.5
"""[-] Explained share of the change: right axes explain more than the first, wrong ones less than
the second. Right axes explain 0.82 to 0.99 for simulated people and cars."""
UNITS = {"rad/s": 1.0, "deg/s": np.pi / 180.0}
AXES = [
    (order, signs)
    for order in permutations(range(3))
    for signs in product((1.0, -1.0), repeat=3)
    if np.linalg.det(np.eye(3)[list(order)]) * np.prod(signs) > 0.0
]
"""Rotations of axes; the opposite sign of all three fits the same changes."""


def find_gyroscope(log: Log) -> list[Finding]:
    """Find wrong units and axes of gyroscopes with a magnetometer."""
    block, found = log.block, list[Finding]()
    for n, node in enumerate(log.constellation.nodes):
        rows = [
            (block.kind[0] == kind) & (block.i[0] == n) & block.valid[0]
            for kind in (Kind.IMU, Kind.MAG)
        ]
        if min(int(r.sum()) for r in rows) < FEWEST:
            continue
        imu, mag = rows
        changes = _changes(
            block.t[0, imu], block.values[0, imu, :3], block.t[0, mag], block.values[0, mag, :3]
        )
        if changes is None:
            continue
        name, text = _judge(*changes)
        if name:
            found.append(Finding(name, (node.id,), f"node {node.id}: {text}"))
    return found


def _changes(t: F64, gyr: F64, t_mag: F64, mag: F64) -> tuple[F64, F64, F64] | None:
    """Return rotations [rad], mean fields and changes of the field over `STEP`, (change, 3)."""
    at = np.arange(max(t[0], t_mag[0]), min(t[-1], t_mag[-1]), STEP)
    if len(at) < FEWEST:
        return None
    turned = np.concatenate([np.zeros((1, 3)), np.cumsum(gyr[1:] * np.diff(t)[:, None], axis=0)])
    angle = np.stack([np.interp(at, t, turned[:, k]) for k in range(3)], axis=-1)
    field = np.stack([np.interp(at, t_mag, mag[:, k]) for k in range(3)], axis=-1)
    change, mean = np.diff(field, axis=0), 0.5 * (field[1:] + field[:-1])
    turns = np.sqrt(np.mean(change**2) / np.mean(mean**2))
    return (np.diff(angle, axis=0), mean, change) if turns > TURNS else None


def _judge(angle: F64, field: F64, change: F64) -> tuple[str, str]:
    """Return name and text of a fault; empty for none."""
    total = float(np.sum(change**2))
    right = _explained(angle, field, change, total)
    if right > FITS_NOT:
        return "", ""
    tries = {
        (unit, axes): _explained(factor * angle, _turned(axes, field), _turned(axes, change), total)
        for unit, factor in UNITS.items()
        for axes in AXES
    }
    straight = AXES[0]
    # Rotations about one axis fit several; the simplest is reported.
    best = max(tries, key=lambda way: tries[way] - 0.1 * (way[1] != straight))
    if tries[best] < FITS:
        return "", ""
    unit, (order, signs) = best
    explains = f"explains {100 * max(right, 0.0):.0f} % of how the magnetic field turns in the body"
    if (order, signs) == straight:
        return "gyro-units", f"gyr_x, gyr_y, gyr_z in rad/s {explains}, in {unit} " + (
            f"{100 * tries[best]:.0f} %"
        )
    axes = ", ".join(
        ("-" if sign < 0.0 else "") + "mag_" + "xyz"[k]
        for k, sign in zip(order, signs, strict=True)
    )
    return (
        "gyro-axes",
        f"the gyroscope {explains}; {100 * tries[best]:.0f} % if x, y, z were {axes}, "
        "or all three with the other sign",
    )


def _turned(axes: tuple[tuple[int, ...], tuple[float, ...]], vectors: F64) -> F64:
    order, signs = axes
    return np.asarray(vectors[:, order] * signs)


def _explained(angle: F64, field: F64, change: F64, total: float) -> float:
    """Return the share of the field's changes that the rotations explain."""
    return 1.0 - float(np.sum((change + np.cross(angle, field)) ** 2)) / total
