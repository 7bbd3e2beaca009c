"""Reports of the external tracker that were not processed yet."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hardware_bridge.readings import PairReading, PoseReading, Vector
from tracking.arrays import F64
from tracking.estimate import Status
from tracking.params.short_repr import short_repr


@dataclass(frozen=True, slots=True)
class PositionReport:
    """Reported position of a pair or a node; world frame."""

    __repr__ = short_repr

    t: float
    """[s] Time of the report."""
    pos: Vector
    """[m] Position."""
    vel: Vector | None
    """[m/s] Velocity."""
    cov: F64 | None
    """Covariance of the position, (3, 3) [m2], or of position and velocity, (6, 6)."""
    status: Status
    nlos: float


@dataclass(frozen=True, slots=True)
class HeadingReport:
    """Reported orientation of a node."""

    t: float
    """[s] Time of the report."""
    q_wb: tuple[float, float, float, float]


class PendingReports:
    """Lists of reports in order of arrival."""

    def __init__(self) -> None:
        self.pairs: list[tuple[int, int, PositionReport]] = []
        """Indices of the nodes, i < j, and the report."""
        self.nodes: list[tuple[int, PositionReport]] = []
        self.headings: list[tuple[int, HeadingReport]] = []

    def add_pair(self, t: float, nodes: tuple[int, ...], reading: PairReading) -> None:
        """Add a position of a pair; nodes by their indices, in the order of the reading."""
        i, j = nodes
        pos, vel = reading.pos, reading.vel
        if i > j:
            i, j, pos = j, i, _opposite(pos)
            vel = None if vel is None else _opposite(vel)
        cov = _square(reading.cov)
        self.pairs.append((i, j, PositionReport(t, pos, vel, cov, reading.status, reading.nlos)))

    def add_pose(self, t: float, node: int, reading: PoseReading) -> None:
        """Add position and orientation of a node."""
        if reading.pos is not None:
            cov = _square(reading.cov)
            place = PositionReport(t, reading.pos, reading.vel, cov, Status.OK, 0.0)
            self.nodes.append((node, place))
        if reading.q_wb is not None:
            self.headings.append((node, HeadingReport(t, reading.q_wb)))

    def clear(self) -> None:
        """Discard all reports."""
        self.pairs.clear()
        self.nodes.clear()
        self.headings.clear()


def _opposite(vector: Vector) -> Vector:
    x, y, z = vector
    return -x, -y, -z


def _square(cov: tuple[float, ...] | None) -> F64 | None:
    if cov is None:
        return None
    size = 3 if len(cov) == 9 else 6
    return np.array(cov).reshape(size, size)
