"""Members of a group: nodes and antennas, and the order in which arrays index them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np

from tracking.arrays import F64, I64, Bool
from tracking.axes import Axes
from tracking.errors import ConfigError
from tracking.mount import Mount
from tracking.vehicles import VEHICLES

MOST_NODES = 256
"""[-] Largest group; a filter of a larger one takes gigabytes."""
SLOWEST_HZ, FASTEST_HZ = 1.0, 10_000.0
"""[1/s] Sample rates that an orientation can be filtered from."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Antenna:
    """An antenna that is not at the origin of its node's body."""

    id: int
    node: int
    """Id of the node that carries it."""
    offset_b: tuple[float, float, float]
    """[m] Position in the body frame of the node."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NodeConfig:
    """One tracker node."""

    id: int
    kind: Literal["moving", "static"] = "moving"
    """A static node has no IMU and never moves."""
    vehicle: str = "none"
    """Vehicle that carries the node, one of `tracking.vehicles.VEHICLES`."""
    initial_heading: float | None = None
    """[rad] Yaw of the body at its first IMU sample, for headings without a magnetometer."""
    imu_hz: float = 100.0
    """[Hz] Nominal rate of the IMU; the orientation filter is built for it."""
    mag_hz: float | None = None
    """[Hz] Nominal rate of the magnetometer; None for the rate of the IMU."""
    mount: Mount = Mount()
    """Position of the tracker on a vehicle that cannot move sideways."""
    imu_axes: Axes = Axes()
    """Axes of gyroscope and accelerometer in the body. Readings are rotated on input, so
    measurements are in axes of the body."""
    mag_axes: Axes = Axes()
    """Axes of the magnetometer in the body."""


@dataclass(frozen=True, kw_only=True)
class Constellation:
    """The nodes of a group and the plane or space they move in.

    Arrays over nodes follow `nodes`; arrays over pairs follow `pairs`, all i < j in
    lexicographic order; arrays over antennas follow their nodes, and every node without an
    antenna of its own has one at the origin of its body.
    """

    nodes: tuple[NodeConfig, ...]
    dimensions: Literal[2, 3] = 3
    """2 where all nodes move in one plane."""
    heading: Literal["magnetic", "initial"] = "magnetic"
    """Source of yaw: the magnetometer, or `NodeConfig.initial_heading`."""
    antennas: tuple[Antenna, ...] = field(default=())

    def __post_init__(self) -> None:
        ids = [node.id for node in self.nodes]
        _expect(2 <= len(ids) <= MOST_NODES, f"nodes: expected 2 to {MOST_NODES}, got {len(ids)}")
        _expect(len(set(ids)) == len(ids), f"nodes: ids must differ, got {ids}")
        for k in ids:
            _expect(
                isinstance(k, int | np.integer) and k >= 0, f"nodes.id: expected 0 or more, got {k}"
            )
        _expect(self.dimensions in (2, 3), f"dimensions: expected 2 or 3, got {self.dimensions!r}")
        _expect(
            self.heading in ("magnetic", "initial"),
            f"heading: expected 'magnetic' or 'initial', got {self.heading!r}",
        )
        for node in self.nodes:
            _expect(
                node.kind in ("moving", "static"),
                f"nodes.{node.id}.kind: expected 'moving' or 'static', got {node.kind!r}",
            )
            _expect(
                node.vehicle in VEHICLES,
                f"nodes.{node.id}.vehicle: expected one of {', '.join(VEHICLES)}, "
                f"got {node.vehicle!r}",
            )
            _expect(
                SLOWEST_HZ <= node.imu_hz <= FASTEST_HZ,
                f"nodes.{node.id}.imu_hz: expected {SLOWEST_HZ:g} to {FASTEST_HZ:g}, "
                f"got {node.imu_hz:g}",
            )
            _expect(
                node.mag_hz is None or 0.0 < node.mag_hz <= FASTEST_HZ,
                f"nodes.{node.id}.mag_hz: expected above 0 and at most {FASTEST_HZ:g}, "
                f"got {node.mag_hz}",
            )
            node.mount.check(f"nodes.{node.id}.mount")
            _expect(
                node.initial_heading is None or math.isfinite(node.initial_heading),
                f"nodes.{node.id}.initial_heading: expected a finite angle, "
                f"got {node.initial_heading}",
            )
        _expect(
            len({a.id for a in self.antennas}) == len(self.antennas), "antennas: ids must differ"
        )
        for antenna in self.antennas:
            _expect(
                len(antenna.offset_b) == 3 and all(math.isfinite(x) for x in antenna.offset_b),
                f"antennas.{antenna.id}.offset_b: expected 3 finite numbers, "
                f"got {antenna.offset_b}",
            )
            _expect(
                antenna.node in ids, f"antennas.{antenna.id}.node: no node {antenna.node} in {ids}"
            )

    @property
    def n_nodes(self) -> int:
        """Number of nodes."""
        return len(self.nodes)

    @property
    def n_pairs(self) -> int:
        """Number of unordered pairs."""
        return self.n_nodes * (self.n_nodes - 1) // 2

    @cached_property
    def ids(self) -> tuple[int, ...]:
        """Node ids in array order."""
        return tuple(node.id for node in self.nodes)

    @cached_property
    def index_of(self) -> dict[int, int]:
        """Array index of each node id."""
        return {node_id: k for k, node_id in enumerate(self.ids)}

    @cached_property
    def pairs(self) -> I64:
        """Node indices of every pair, (pair, 2), i < j."""
        return np.stack(np.triu_indices(self.n_nodes, k=1), axis=1).astype(np.int64)

    @cached_property
    def pair_index(self) -> I64:
        """Pair of two nodes in either order, (node, node); the diagonal is -1, never read."""
        table = np.full((self.n_nodes, self.n_nodes), -1, dtype=np.int64)
        i, j = self.pairs.T
        table[i, j] = table[j, i] = np.arange(self.n_pairs)
        return table

    @cached_property
    def is_static(self) -> Bool:
        """True for nodes that never move, (node)."""
        return np.array([node.kind == "static" for node in self.nodes])

    @cached_property
    def all_antennas(self) -> tuple[Antenna, ...]:
        """Antennas in array order: those of the first node, of the second, and so on."""
        table: list[Antenna] = []
        for node in self.nodes:
            own = [a for a in self.antennas if a.node == node.id]
            table += own or [Antenna(id=-1, node=node.id, offset_b=(0.0, 0.0, 0.0))]
        return tuple(table)

    @cached_property
    def antenna_node(self) -> I64:
        """Node index of each antenna, (antenna)."""
        return np.array([self.index_of[a.node] for a in self.all_antennas], dtype=np.int64)

    @cached_property
    def antenna_offset_b(self) -> F64:
        """Antenna positions in their node's body frame, (antenna, 3) [m].

        In the plane, nodes have no height; that of their mount is added to z.
        """
        offset = np.array([a.offset_b for a in self.all_antennas], dtype=np.float64)
        if self.dimensions == 2:
            height = np.array([node.mount.height for node in self.nodes])
            offset[:, 2] += height[self.antenna_node]
        return offset

    def antenna_index(self, node_id: int, antenna_id: int | None) -> int:
        """Return the array index of a node's antenna.

        Raises:
            ConfigError: The node has no such antenna, or has several and none is named.
        """
        own = [k for k, a in enumerate(self.all_antennas) if a.node == node_id]
        if antenna_id is None:
            _expect(len(own) == 1, f"node {node_id} has {len(own)} antennas: name the one used")
            return own[0]
        named = [k for k in own if self.all_antennas[k].id == antenna_id]
        _expect(len(named) == 1, f"node {node_id} has no antenna {antenna_id}")
        return named[0]


def _expect(condition: bool, message: str) -> None:
    if not condition:
        raise ConfigError(message)
