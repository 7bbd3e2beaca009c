"""What is known of a swarm at one moment: nodes and pairs as rows, for tables, JSON and views."""

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
    """One node."""

    node: int
    """Its id."""
    heard_ago: float | None
    """[s] None before it was ever heard."""
    imu_hz: float
    """[1/s] Samples of its IMU."""
    range_hz: float
    """[1/s] Ranges with it at one end."""
    voltage: float | None
    """[V] None where it does not say."""
    heading: float | None
    """[rad] Counter-clockwise from the x axis of the world; None where it is not known."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PairRow:
    """Where the second node is, seen from the first; carried to this moment."""

    node_i: int
    node_j: int
    status: str
    """A `Status` in small letters; without an estimate the figures are None."""
    pos_w: tuple[float, float, float] | None
    """[m] In the axes of the world."""
    cov_w: tuple[float, float, float] | None
    """[m2] Of its plane: xx, yy, xy."""
    forward: float | None
    """[m] Ahead of the first node, level; None where its heading is not known."""
    left: float | None
    """[m] To its left, level."""
    up: float | None
    """[m] Above it; None in a plane."""
    distance: float | None
    """[m]"""
    std: float | None
    """[m] Largest standard deviation of the position in any direction."""
    age: float | None
    """[s] Since the last accepted range."""
    nlos_prob: float | None
    """[-] Probability that it was not line of sight."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Snapshot:
    """All of it."""

    t_ns: int
    """Host time [ns]."""
    t: float
    """[s] Since the run began."""
    nodes: tuple[NodeRow, ...]
    pairs: tuple[PairRow, ...]

    @property
    def n_ok(self) -> int:
        """Pairs whose estimate can be used."""
        return sum(pair.status == "ok" for pair in self.pairs)

    @property
    def pair_records(self) -> list[dict[str, Any]]:
        """The pairs, ready for JSON."""
        head = {"result": "pair", "t": round(self.t, 6)}
        return [head | asdict(pair) for pair in self.pairs]


def take_snapshot(swarm: LiveSwarm, hz: F64, t_ns: int) -> Snapshot:
    """What is known now.

    Args:
        swarm: Right after its step.
        hz: Samples and ranges a second, (2, node) [1/s].
        t_ns: Host time of that step [ns].
    """
    group, intake = swarm.group, swarm.intake
    headings = _headings(swarm)
    nodes = tuple(
        NodeRow(
            node=node,
            heard_ago=(t_ns - intake.heard_ns[k]) * 1e-9 if k in intake.heard_ns else None,
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
    """Of all nodes: of moving ones now, by their gyroscopes too; of the others as they stand."""
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
