"""Calibration of sensors from a recorded run (`relpos calibrate`)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from tracking.calibration import (
    Calibration,
    CalibrationError,
    ImuResult,
    MagResult,
    RangeTable,
    UwbParams,
    UwbResult,
    calibrate_imu,
    calibrate_magnetometer,
    calibrate_uwb,
    merge,
    range_table,
    read_calibration,
)
from tracking.geometry import GRAVITY
from tracking.log import Log
from tracking.measurements import Kind
from tracking.params.short_repr import short_repr


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrateResult:
    """Calibration of one kind of sensor from one log."""

    __repr__ = short_repr

    log: Log
    calibration: Calibration
    imu: Mapping[int, ImuResult] = field(default_factory=dict)
    """IMU results by node id."""
    mag: Mapping[int, MagResult] = field(default_factory=dict)
    """Magnetometer results by node id."""
    uwb: UwbResult | None = None
    ranges: RangeTable | None = None
    """Input of the UWB calibration."""
    refused: Mapping[int, str] = field(default_factory=dict)
    """Reasons for nodes that were not calibrated, by node id."""
    sensor: str
    """`imu`, `mag` or `uwb`."""

    @property
    def summary(self) -> list[dict[str, Any]]:
        """Records for JSON: one per node, for UWB preceded by one of the group."""
        head = {"log": self.log.name}
        records = [
            {**head, "sensor": "imu", "node": n, **_imu_record(r)} for n, r in self.imu.items()
        ]
        records += [
            {**head, "sensor": "mag", "node": n, **_mag_record(r)} for n, r in self.mag.items()
        ]
        if self.uwb is not None:
            records.append({**head, "sensor": "uwb", **_uwb_record(self.uwb, self.log)})
            offset = self.uwb.calibration.offset
            records += [
                {**head, "sensor": "uwb", "node": n, "offset_m": b} for n, b in offset.items()
            ]
        return records + [
            {**head, "sensor": self.sensor, "node": n, "refused": why}
            for n, why in self.refused.items()
        ]


def calibrate_imus(log: Log, *, level: bool = False, gravity: float = GRAVITY) -> CalibrateResult:
    """Estimate gyroscope and accelerometer offsets of every node while it is at rest.

    Args:
        log: A run in which the nodes are at rest for some time.
        level: True if the nodes are level whenever they are at rest.
        gravity: Local gravity [m/s2].

    Raises:
        CalibrationError: No node can be calibrated.
    """

    def one(n: int) -> ImuResult:
        chosen = _events(log, n, Kind.IMU)
        imu = log.block.values[0, chosen, :6]
        return calibrate_imu(log.block.t[0, chosen], imu, level=level, gravity=gravity)

    found, refused = _each_node(log, Kind.IMU, one)
    nodes = {n: r.calibration for n, r in found.items()}
    return CalibrateResult(
        log=log, sensor="imu", calibration=Calibration(nodes=nodes), imu=found, refused=refused
    )


def calibrate_magnetometers(log: Log, *, seed: int = 0) -> CalibrateResult:
    """Estimate the hard- and soft-iron errors of every node.

    Args:
        log: A run in which the nodes are rotated on the spot in every direction.
        seed: Seed of the robust fit.

    Raises:
        CalibrationError: No node can be calibrated.
    """

    def one(n: int) -> MagResult:
        mag = log.block.values[0, _events(log, n, Kind.MAG), :3]
        return calibrate_magnetometer(mag, rng=np.random.default_rng(seed))

    found, refused = _each_node(log, Kind.MAG, one)
    nodes = {n: r.calibration for n, r in found.items()}
    return CalibrateResult(
        log=log, sensor="mag", calibration=Calibration(nodes=nodes), mag=found, refused=refused
    )


def calibrate_ranges(log: Log, *, seed: int = 0, max_distance: float = 8.0) -> CalibrateResult:
    """Estimate range slope and antenna delays of all nodes jointly against ground truth.

    Args:
        log: A run with ground truth.
        seed: Seed of RANSAC.
        max_distance: Longest range that is used [m].

    Raises:
        CalibrationError: The data of the log are insufficient.
    """
    table = range_table(log.block, log.constellation, log.truth)
    params = UwbParams(max_distance=max_distance)
    try:
        result = calibrate_uwb(table, log.constellation.ids, random_state=seed, params=params)
    except CalibrationError as error:
        raise CalibrationError(f"{log.name}: {error}") from error
    ranging = {log.constellation.ids[n] for n in np.union1d(table.i, table.j)}
    without = sorted(ranging - set(result.calibration.offset))
    return CalibrateResult(
        log=log,
        sensor="uwb",
        calibration=Calibration(ranges=result.calibration),
        uwb=result,
        ranges=table,
        refused=dict.fromkeys(without, "too few ranges that agree with a true distance"),
    )


def apply_calibrations(log: Log, paths: Iterable[Path | str]) -> Log:
    """Return a log with measurements corrected by one or more calibration files.

    Raises:
        ConfigError: A file is invalid, two contain the same field, or they do not fit the log.
    """
    calibration = merge(read_calibration(path) for path in paths)
    return replace(log, block=calibration.apply(log.block, log.constellation))


def _events(log: Log, n: int, kind: Kind) -> np.ndarray:
    chosen: np.ndarray = log.block.valid[0] & (log.block.kind[0] == kind) & (log.block.i[0] == n)
    return chosen


def _each_node(
    log: Log, kind: Kind, calibrate: Callable[[int], Any]
) -> tuple[dict[int, Any], dict[int, str]]:
    """Return results and refusals by id, for nodes with measurements of a kind."""
    found: dict[int, Any] = {}
    refused: dict[int, str] = {}
    for n, node_id in enumerate(log.constellation.ids):
        if not _events(log, n, kind).any():
            continue
        try:
            found[node_id] = calibrate(n)
        except CalibrationError as error:
            refused[node_id] = str(error)
    if not found:
        reasons = "; ".join(f"node {n}: {why}" for n, why in refused.items())
        raise CalibrationError(f"{log.name}: {reasons or f'no {kind.name} measurements'}")
    return found, refused


def _imu_record(r: ImuResult) -> dict[str, Any]:
    c = r.calibration
    return {
        "rest_s": r.rest.duration,
        "gyr_offset_rad_s": c.gyr_offset,
        "gyr_se_rad_s": r.gyr_se.tolist(),
        "acc_method": r.acc_method,
        "poses": r.n_poses,
        "directions_seen": r.n_seen,
        "acc_offset_m_s2": c.acc_offset,
        "acc_scale": c.acc_scale,
        "residual_before_m_s2": r.residual_before,
        "residual_after_m_s2": r.residual_after,
    }


def _mag_record(r: MagResult) -> dict[str, Any]:
    return {
        "method": r.method,
        "mag_offset_uT": r.calibration.mag_offset,
        "mag_matrix": r.calibration.mag_matrix,
        "field_uT": r.field,
        "coverage": r.coverage,
        "residual_before": r.residual_before,
        "residual_after": r.residual_after,
        "inlier_share": float(r.inlier.mean()),
    }


def _uwb_record(r: UwbResult, log: Log) -> dict[str, Any]:
    nlos = log.nlos
    return {
        "slope": r.calibration.slope,
        "slope_fitted": r.slope_fitted,
        "slope_se": r.slope_se,
        "separable": r.separable,
        "ranges": int(r.used.sum()),
        "inlier_share": r.inlier_share,
        "residual_std_m": r.residual_std,
        "median_before_m": float(np.median(r.error_before[r.used])),
        "median_after_m": float(np.median(r.error_after[r.used])),
        "rms_before_m": float(np.sqrt(np.mean(r.error_before[r.used] ** 2))),
        "rms_after_m": float(np.sqrt(np.mean(r.error_after[r.used] ** 2))),
        "distance_m": r.distance,
        "nlos_share": None if nlos is None else float(nlos[r.used].mean()),
        "nlos_share_inliers": None if nlos is None else float(nlos[r.inlier].mean()),
    }
