"""Snapshot of a swarm: rows of nodes and pairs for tables, JSON and views."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from hardware_bridge.live.swarm import LiveSwarm
from tracking.arrays import F64
from tracking.estimate import Status, TeamEstimate

_NOTHING = (Status.ABSENT, Status.STARTING)


@dataclass(frozen=True, slots=True, kw_only=True)
class NodeRow:
    """State of one node."""

    node: int
    """Id of the node."""
    message_age: float | None
    """[s] Time since its last message; None before the first one."""
    imu_hz: float
    """[1/s] Rate of its IMU samples."""
    range_hz: float
    """[1/s] Rate of its ranges, to and from other nodes."""
    voltage: float | None
    """[V] Battery voltage; None if not reported."""
    heading: float | None
    """[rad] Heading, counter-clockwise from the x axis of the world; None if unknown."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PairRow:
    """Position of the second node relative to the first, predicted to the time of the snapshot."""

    node_i: int
    node_j: int
    status: str
    """`Status` in lower case; without an estimate, all other values are None."""
    pos_w: tuple[float, float, float] | None
    """[m] Relative position in the axes of the world."""
    cov_w: tuple[float, float, float] | None
    """[m2] Horizontal covariance in the axes of the world: xx, yy, xy."""
    forward: float | None
    """[m] Horizontal offset along the heading of the first node; None if its heading is unknown."""
    left: float | None
    """[m] Horizontal offset to the left of the first node; None if its heading is unknown."""
    up: float | None
    """[m] Height above the first node; None in two dimensions."""
    distance: float | None
    """[m] Estimated distance."""
    std: float | None
    """[m] Standard deviation of the position in the least certain direction."""
    age: float | None
    """[s] Time since the last accepted range."""
    nlos_prob: float | None
    """[-] NLOS probability."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Snapshot:
    """All nodes and pairs at one time."""

    t_ns: int
    """[ns] Host time."""
    t: float
    """[s] Time since the start of the run."""
    nodes: tuple[NodeRow, ...]
    pairs: tuple[PairRow, ...]

    @property
    def n_ok(self) -> int:
        """[-] Number of pairs with the status ``ok``."""
        return sum(pair.status == "ok" for pair in self.pairs)

    @property
    def pair_records(self) -> list[dict[str, Any]]:
        """Pairs as JSON records."""
        head = {"result": "pair", "t": round(self.t, 6)}
        return [head | asdict(pair) for pair in self.pairs]


def take_snapshot(swarm: LiveSwarm, hz: F64, t_ns: int) -> Snapshot:
    """Return a snapshot of a swarm.

    Args:
        swarm: Swarm right after a step.
        hz: Rates of samples and ranges, (2, node) [1/s].
        t_ns: Host time of the step [ns].
    """
    group, intake = swarm.group, swarm.intake
    headings = _headings(swarm)
    nodes = tuple(
        NodeRow(
            node=node,
            message_age=(t_ns - intake.received_ns[k]) * 1e-9 if k in intake.received_ns else None,
            imu_hz=float(hz[0, k]),
            range_hz=float(hz[1, k]),
            voltage=intake.voltage.get(k),
            heading=headings[k],
        )
        for k, node in enumerate(group.ids)
    )
    t = intake.seconds(t_ns)
    estimate = swarm.estimate.take(0).at(t)
    pairs = tuple(_pair(estimate, p, headings) for p in range(group.n_pairs))
    return Snapshot(t_ns=t_ns, t=t, nodes=nodes, pairs=pairs)


def _headings(swarm: LiveSwarm) -> list[float | None]:
    """Return headings [rad]: gyro-predicted ones of the slots, estimated ones of other nodes."""
    view, e = swarm.view, swarm.estimate
    headings: list[float | None] = []
    for k in range(swarm.group.n_nodes):
        if k < swarm.config.n_slots:
            headings.append(float(view.heading[0, k]) if view.oriented[0, k] else None)
        elif e.has_orientation[0, k]:
            w, x, y, z = e.q_wb[0, k]
            headings.append(float(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))))
        else:
            headings.append(None)
    return headings


def _pair(e: TeamEstimate, p: int, headings: list[float | None]) -> PairRow:
    group = e.constellation
    i, j = (int(k) for k in group.pairs[p])
    status = Status(int(e.status[p]))
    pos, cov = e.pos_ij_w[p], e.cov[p, :3, :3]
    known = status not in _NOTHING and bool(np.isfinite(pos).all() and np.isfinite(cov).all())
    heading = headings[i] if known else None
    forward = left = None
    if heading is not None:
        c, s = np.cos(heading), np.sin(heading)
        forward, left = float(c * pos[0] + s * pos[1]), float(c * pos[1] - s * pos[0])
    largest = float(np.linalg.eigvalsh(cov)[-1]) if known else 0.0
    return PairRow(
        node_i=group.ids[i],
        node_j=group.ids[j],
        status=status.name.lower(),
        pos_w=(float(pos[0]), float(pos[1]), float(pos[2])) if known else None,
        cov_w=(float(cov[0, 0]), float(cov[1, 1]), float(cov[0, 1])) if known else None,
        forward=forward,
        left=left,
        up=float(pos[2]) if known and group.dimensions == 3 else None,
        distance=float(np.linalg.norm(pos)) if known else None,
        std=float(np.sqrt(max(largest, 0.0))) if known else None,
        age=float(e.age[p]) if known else None,
        nlos_prob=float(e.nlos_prob[p]) if known else None,
    )
