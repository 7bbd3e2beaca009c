"""``[nodes.ID]`` and ``[antennas.ID]``: the nodes and antennas of the group."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from hardware_bridge.config.keys import node_id, tables_of
from tracking.axes import Axes
from tracking.constellation import Antenna, Constellation, NodeConfig
from tracking.errors import ConfigError
from tracking.mount import KEYS, Mount
from tracking.params.tables import TableReader, Where

FARTHEST = 10.0
"""[m] Largest offset of an antenna from its node along an axis."""


@dataclass(frozen=True, kw_only=True)
class _Mount:
    """Table with the keys of `tracking.mount.KEYS`."""

    ahead_m: float | None = None
    aside_m: float = 0.0
    wheelbase_m: float | None = None
    slip_s2_per_m: float | None = None
    height_m: float = 0.0


@dataclass(frozen=True, kw_only=True)
class _Node:
    kind: Literal["moving", "static"] = "moving"
    vehicle: str = "car"
    initial_heading_rad: float | None = None
    imu_hz: float = 100.0
    mag_hz: float | None = None
    mount: _Mount = _Mount()
    imu_axes: tuple[str, str, str] = ("x", "y", "z")
    mag_axes: tuple[str, str, str] = ("x", "y", "z")


@dataclass(frozen=True, kw_only=True)
class _Antenna:
    node: int
    offset_m: tuple[float, float, float]


def read_constellation(
    raw: Mapping[str, Any], dimensions: int, heading: Literal["magnetic", "initial"], where: Where
) -> Constellation:
    """Read the nodes, moving ones first.

    Args:
        raw: The complete file.
        dimensions: 2 or 3.
        heading: Heading reference, see `Constellation`.
        where: The file, for messages.
    """
    nodes, antennas = [], []
    for key, table in tables_of(raw, "nodes", where):
        at = where.key("nodes").key(key)
        node = TableReader().read(_Node, table, at)
        if node.mag_hz is not None and not node.mag_hz > 0.0:
            raise at.key("mag_hz").error(f"expected above 0, got {node.mag_hz:g}")
        mount = Mount(**{name: getattr(node.mount, name_m) for name_m, name in KEYS.items()})
        try:
            mount.check("mount")
        except ConfigError as error:
            raise at.error(str(error)) from error
        axes = {}
        for name, mirrored in (("imu_axes", False), ("mag_axes", True)):
            try:
                axes[name] = Axes.parse(getattr(node, name), mirrored=mirrored)
            except ConfigError as error:
                raise at.key(name).error(str(error)) from error
        nodes.append(
            NodeConfig(
                id=node_id(key, at),
                kind=node.kind,
                vehicle=node.vehicle,
                initial_heading=node.initial_heading_rad,
                imu_hz=node.imu_hz,
                mag_hz=node.mag_hz,
                mount=mount,
                **axes,
            )
        )
    for key, table in tables_of(raw, "antennas", where):
        at = where.key("antennas").key(key)
        antenna = TableReader().read(_Antenna, table, at)
        if any(not abs(x) <= FARTHEST for x in antenna.offset_m):
            raise at.key("offset_m").error(
                f"expected metres within {FARTHEST:g}, got {list(antenna.offset_m)}"
            )
        antennas.append(Antenna(id=node_id(key, at), node=antenna.node, offset_b=antenna.offset_m))
    nodes.sort(key=lambda node: node.kind == "static")
    try:
        return Constellation(
            nodes=tuple(nodes),
            dimensions=dimensions,  # type: ignore[arg-type]  # checked by Constellation
            heading=heading,
            antennas=tuple(antennas),
        )
    except ConfigError as error:
        raise where.error(str(error)) from error
