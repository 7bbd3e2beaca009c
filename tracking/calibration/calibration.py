"""Sensor errors of a group, and their correction.

    gyr = gyr_raw - offset
    acc = scale * (acc_raw - offset)
    mag = M (mag_raw - offset)
    distance = (range - b_i - b_j) / slope

Properties: an empty calibration changes nothing, bit for bit; `apply` neither adds nor drops
events; the division of events into blocks has no effect.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields, replace

import numpy as np

from tracking.constellation import Constellation
from tracking.errors import ConfigError
from tracking.measurements import Kind, MeasurementBlock

Vector = tuple[float, float, float]
Matrix = tuple[Vector, Vector, Vector]

MIN_DISTANCE = 0.01
"""[m] Least corrected range."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NodeCalibration:
    """Sensor errors of one node, in its body frame; None for sensors without calibration."""

    gyr_offset: Vector | None = None
    """[rad/s] Offset of the gyroscope."""
    acc_offset: Vector | None = None
    """[m/s2] Offset of the accelerometer."""
    acc_scale: Vector | None = None
    """[-] Scale of each axis of the accelerometer."""
    mag_offset: Vector | None = None
    """[uT] Hard iron."""
    mag_matrix: Matrix | None = None
    """[-] M, which corrects soft iron."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RangeCalibration:
    """Range errors of a group: a common slope, and antenna offsets of each node."""

    slope: float = 1.0
    """[-] a of ``range = a distance + b_i + b_j``."""
    offset: Mapping[int, float] = field(default_factory=dict)
    """[m] b of each node, by id."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Calibration:
    """Sensor errors of a group."""

    nodes: Mapping[int, NodeCalibration] = field(default_factory=dict)
    """Calibrations by node id."""
    ranges: RangeCalibration | None = None
    """None for ranges without calibration."""

    def apply(self, block: MeasurementBlock, constellation: Constellation) -> MeasurementBlock:
        """Correct IMU, MAG and RANGE events.

        STATE events come from a node's own filter, after its own calibration. They and sensors
        without calibration are unchanged.

        Args:
            block: Raw measurements.
            constellation: Nodes of the block.

        Returns:
            A block of the same events.

        Raises:
            ConfigError: Ranges are calibrated and a node with ranges has no offset, or no node of
                the calibration is in the group.
        """
        known = set(self.nodes) | set(self.ranges.offset if self.ranges else ())
        if known and not known & set(constellation.ids):
            raise ConfigError(
                f"calibration: expected some of the nodes {_list(constellation.ids)}, "
                f"found only {_list(known)}"
            )
        values = block.values.copy()
        for node_id, node in self.nodes.items():
            if node_id in constellation.index_of:
                _correct_node(values, block, constellation.index_of[node_id], node)
        if self.ranges is not None:
            _correct_ranges(values, block, constellation, self.ranges)
        return replace(block, values=values)


def merge(calibrations: Iterable[Calibration]) -> Calibration:
    """Merge calibrations, such as those of IMUs and of ranges.

    Raises:
        ConfigError: Two calibrations have the same field of the same node, or both have ranges.
    """
    nodes: dict[int, NodeCalibration] = {}
    ranges: RangeCalibration | None = None
    for calibration in calibrations:
        for node_id, node in calibration.nodes.items():
            nodes[node_id] = _merge_node(node_id, nodes.get(node_id, NodeCalibration()), node)
        if calibration.ranges is not None:
            if ranges is not None:
                raise ConfigError("calibration, ranges: given twice, expected once")
            ranges = calibration.ranges
    return Calibration(nodes=nodes, ranges=ranges)


def _merge_node(node_id: int, first: NodeCalibration, second: NodeCalibration) -> NodeCalibration:
    given = {f.name: getattr(second, f.name) for f in fields(second)}
    given = {name: value for name, value in given.items() if value is not None}
    for name in given:
        if getattr(first, name) is not None:
            raise ConfigError(f"calibration, nodes.{node_id}.{name}: given twice, expected once")
    return replace(first, **given)


def _correct_node(
    values: np.ndarray, block: MeasurementBlock, index: int, node: NodeCalibration
) -> None:
    mine = block.valid & (block.i == index)
    imu, mag = mine & (block.kind == Kind.IMU), mine & (block.kind == Kind.MAG)
    rows = values[imu]
    if node.gyr_offset is not None:
        rows[:, :3] -= node.gyr_offset
    if node.acc_offset is not None:
        rows[:, 3:6] -= node.acc_offset
    if node.acc_scale is not None:
        rows[:, 3:6] *= node.acc_scale
    values[imu] = rows
    rows = values[mag]
    if node.mag_offset is not None:
        rows[:, :3] -= node.mag_offset
    if node.mag_matrix is not None:
        # Column by column, so that a row does not depend on the number of rows.
        matrix = np.array(node.mag_matrix)
        x, y, z = (rows[:, k : k + 1].copy() for k in range(3))
        rows[:, :3] = x * matrix[:, 0] + y * matrix[:, 1] + z * matrix[:, 2]
    values[mag] = rows


def _correct_ranges(
    values: np.ndarray,
    block: MeasurementBlock,
    constellation: Constellation,
    ranges: RangeCalibration,
) -> None:
    chosen = block.valid & (block.kind == Kind.RANGE)
    i, j = block.i[chosen], block.j[chosen]
    ranging = [constellation.ids[n] for n in np.union1d(i, j)]
    missing = [node_id for node_id in ranging if node_id not in ranges.offset]
    if missing:
        raise ConfigError(
            f"calibration, ranges.offset_m: expected every node that has ranges, "
            f"found none of node {_list(missing)}"
        )
    offset = np.array([ranges.offset.get(node_id, 0.0) for node_id in constellation.ids])
    raw = values[chosen, 0]
    corrected = (raw - (offset[i] + offset[j])) / ranges.slope
    values[chosen, 0] = np.maximum(corrected, np.minimum(raw, MIN_DISTANCE))


def _list(ids: Iterable[int]) -> str:
    return ", ".join(str(node_id) for node_id in sorted(ids))
