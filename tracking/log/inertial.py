"""Requirements on inertial samples: one clock, distinct times, a heading, a rate."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tracking.arrays import F64
from tracking.axes import Axes
from tracking.constellation import FASTEST_HZ, SLOWEST_HZ, Constellation
from tracking.errors import LogError
from tracking.measurements import Kind, MeasurementBlock

MOST_AT_ONCE = 0.6
"""[-] Largest share of samples with the time of their predecessor; pairs are accepted."""
FEW = 20
"""[-] Least number of samples for a check."""
TOGETHER = 0.5
"""[-] Least share of magnetometer readings while the IMU runs."""
LONG_GAP = 10.0
"""[-] Periods after which an interval does not count for a rate."""


def check_inertial(block: MeasurementBlock, constellation: Constellation) -> None:
    """Check that inertial samples share the clock of the ranges and have a heading."""
    kind, t = block.kind[0], block.t[0]
    inertial = np.isin(kind, (Kind.IMU, Kind.STATE))
    if not inertial.any():
        return
    ranges = t[kind == Kind.RANGE]
    start, end = t[inertial].min(), t[inertial].max()
    if start > ranges.max() or end < ranges.min():
        raise LogError(
            f"imu.csv, t_s: samples from {start:g} to {end:g} s, ranges from {ranges.min():g} to "
            f"{ranges.max():g} s; expected one clock"
        )
    for what, file in ((Kind.IMU, "imu.csv"), (Kind.MAG, "mag.csv")):
        _check_times(block, constellation, what, file)
    mag = t[kind == Kind.MAG]
    if len(mag) and np.mean((mag >= start) & (mag <= end)) < TOGETHER:
        raise LogError(
            f"mag.csv, t_s: readings from {mag.min():g} to {mag.max():g} s, imu.csv from {start:g} "
            f"to {end:g} s; expected one clock"
        )
    if constellation.heading == "magnetic" and not np.isin(kind, (Kind.MAG, Kind.STATE)).any():
        raise LogError(
            "meta.toml, heading: 'magnetic' needs magnetometer readings and there are none, "
            "expected 'initial'"
        )


def _check_times(
    block: MeasurementBlock, constellation: Constellation, kind: Kind, file: str
) -> None:
    """Check that samples have distinct times, without which rotations are unknown."""
    for n in range(constellation.n_nodes):
        t = block.t[0, (block.kind[0] == kind) & (block.i[0] == n)]
        if len(t) >= FEW and np.mean(np.diff(t) <= 0.0) > MOST_AT_ONCE:
            raise LogError(
                f"{file}, t_s: {100 * np.mean(np.diff(t) <= 0.0):.0f} % of the samples of node "
                f"{constellation.ids[n]} have the time of the one before; expected when each was "
                "taken"
            )


def in_body_axes(
    constellation: Constellation, block: MeasurementBlock
) -> tuple[Constellation, MeasurementBlock]:
    """Return the samples in axes of the body, and the constellation of such samples."""
    if all(node.imu_axes.is_body and node.mag_axes.is_body for node in constellation.nodes):
        return constellation, block
    values = block.values.copy()
    for n, node in enumerate(constellation.nodes):
        imu = (block.kind[0] == Kind.IMU) & (block.i[0] == n)
        mag = (block.kind[0] == Kind.MAG) & (block.i[0] == n)
        for first in (0, 3):
            values[0, imu, first : first + 3] = node.imu_axes.turn(
                values[0, imu, first : first + 3]
            )
        values[0, mag, :3] = node.mag_axes.turn(values[0, mag, :3])
    nodes = tuple(replace(n, imu_axes=Axes(), mag_axes=Axes()) for n in constellation.nodes)
    return replace(constellation, nodes=nodes), replace(block, values=values)


def with_rates(constellation: Constellation, block: MeasurementBlock) -> Constellation:
    """Return the constellation with the sensor rates of the recording.

    Raises:
        LogError: The sample rate of a node is outside the tracker's limits.
    """
    nodes = []
    for n, config in enumerate(constellation.nodes):
        mine = block.i[0] == n
        samples = block.t[0, mine & (block.kind[0] == Kind.IMU)]
        imu_hz = _rate(samples)
        is_known = imu_hz is not None and SLOWEST_HZ <= imu_hz <= FASTEST_HZ
        if imu_hz is None or (len(samples) < FEW and not is_known):
            imu_hz = config.imu_hz
        elif not is_known:
            raise LogError(
                f"imu.csv, t_s: {imu_hz:g} samples a second of node {config.id}, expected "
                f"{SLOWEST_HZ:g} to {FASTEST_HZ:g}"
            )
        mag_hz = _rate(block.t[0, mine & (block.kind[0] == Kind.MAG)])
        nodes.append(
            replace(
                config,
                imu_hz=imu_hz,
                mag_hz=None if mag_hz in (0.0, imu_hz, None) or mag_hz > FASTEST_HZ else mag_hz,
            )
        )
    return replace(constellation, nodes=tuple(nodes))


def _rate(t: F64) -> float | None:
    """Return the nominal rate of a sensor from its times, rounded to 0.01 Hz, or None.

    Samples may be missing, and times are often rounded to a millisecond: single steps are wrong,
    their sum is not. So each step is counted as a whole number of periods. Samples in packets are
    more than the periods.
    """
    every = np.diff(t)
    dt = every[every > 0.0]
    if len(dt) < 2:
        return None
    period = float(np.median(dt))
    dt, every = dt[dt < LONG_GAP * period], every[every < LONG_GAP * period]
    for _ in range(3):
        period = float(dt.sum() / np.maximum(np.round(dt / period), 1.0).sum())
    in_packets = len(every) / float(dt.sum()) if len(every) >= FEW else 0.0
    return round(max(1.0 / period, in_packets), 2)
