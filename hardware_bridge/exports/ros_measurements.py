"""Measurements as ROS 2 messages, with topics and signs of REP 145."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from hardware_bridge.exports.ros_definitions import IMU, MAGNETIC_FIELD, UWB_RANGE
from hardware_bridge.exports.ros_parts import Message, frame, header, quaternion, xyz
from hardware_bridge.exports.stamps import stamps_ns
from tracking.constellation import Constellation
from tracking.geometry import GRAVITY, quat_conjugate, rotate
from tracking.measurements import Kind, MeasurementBlock

RANGES = "/uwb/ranges"
TESLA = 1e-6
"""[T/uT] Unit of magnetic fields."""
_UNKNOWN = [0.0] * 9
"""Covariance that is not given: zeros."""
_ABSENT = [-1.0, *_UNKNOWN[1:]]
"""Covariance of a quantity that was not measured."""
_NONE = (0.0, 0.0, 0.0)
_IDENTITY = (1.0, 0.0, 0.0, 0.0)


def measurement_messages(
    block: MeasurementBlock, constellation: Constellation, offset_ns: int
) -> Iterator[Message]:
    """Yield messages in order of time from one environment; JOIN and LEAVE have none.

    Raises:
        BridgeError: A time is outside of the range of ROS.
    """
    block = block.env(0).sorted()
    stamps = stamps_ns(block.t, offset_ns)
    antennas = [a.id for a in constellation.all_antennas]
    for k, t_ns in enumerate(stamps):
        kind, node = block.kind[0, k], constellation.ids[block.i[0, k]]
        values = block.values[0, k]
        content: dict[str, Any] = {"header": header(t_ns, frame(node))}
        if kind == Kind.IMU:
            content |= _imu(gyr=values[:3], acc=values[3:6])
            yield Message(t_ns, f"/{frame(node)}/imu/data_raw", IMU, content)
        elif kind == Kind.STATE:
            # Restore the specific force: the node has subtracted gravity.
            acc = rotate(quat_conjugate(values[:4]), values[4:7] + [0.0, 0.0, GRAVITY])
            content |= _imu(acc=acc, q_wb=values[:4])
            yield Message(t_ns, f"/{frame(node)}/imu/data", IMU, content)
        elif kind == Kind.MAG:
            content |= {
                "magnetic_field": xyz(values[:3] * TESLA),
                "magnetic_field_covariance": _UNKNOWN,
            }
            yield Message(t_ns, f"/{frame(node)}/imu/mag", MAGNETIC_FIELD, content)
        elif kind in (Kind.RANGE, Kind.SURVEY):
            powered = bool(block.has_power[0, k])
            content |= {
                "node_i": node,
                "node_j": constellation.ids[block.j[0, k]],
                "antenna_i": antennas[block.antenna_i[0, k]],
                "antenna_j": antennas[block.antenna_j[0, k]],
                "range": float(values[0]),
                "surveyed": bool(kind == Kind.SURVEY),
                "has_power": powered,
                "rx_power": float(values[1]) if powered else 0.0,
                "fp_power": float(values[2]) if powered else 0.0,
            }
            yield Message(t_ns, RANGES, UWB_RANGE, content)


def _imu(
    *, acc: np.ndarray, gyr: np.ndarray | None = None, q_wb: np.ndarray | None = None
) -> dict[str, Any]:
    return {
        "orientation": quaternion(_IDENTITY if q_wb is None else q_wb.tolist()),
        "orientation_covariance": _ABSENT if q_wb is None else _UNKNOWN,
        "angular_velocity": xyz(_NONE if gyr is None else gyr.tolist()),
        "angular_velocity_covariance": _ABSENT if gyr is None else _UNKNOWN,
        "linear_acceleration": xyz(acc.tolist()),
        "linear_acceleration_covariance": _UNKNOWN,
    }
