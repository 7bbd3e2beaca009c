"""The swarm.toml of an emulation, as a user would write it for such devices."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from agents.hardware.emulate.options import EmulateOptions
from hardware_bridge.config.streams import SLOWEST_WATCHDOG
from hardware_bridge.emulator.cars.base import DEADMAN
from hardware_bridge.emulator.formats import WireFormat
from hardware_bridge.emulator.node import EmulatedNode
from relpos_env.config import Parts
from relpos_env.interface.actions import MAX_SPEED
from relpos_env.timing import DT
from tracking.constellation import Constellation, NodeConfig
from tracking.mount import Mount


def swarm_toml(
    options: EmulateOptions,
    parts: Parts,
    constellation: Constellation,
    nodes: Sequence[tuple[EmulatedNode, Sequence[str]]],
    folder: Path,
    only: int | None = None,
) -> str:
    """Return the text of the file.

    Args:
        options: Options of the emulation.
        parts: Parts of the world.
        constellation: Constellation of the nodes.
        nodes: Every node with the names of its ports.
        folder: Folder of the ports.
        only: Node whose links and car are listed, for the computer of that car; None for all.
    """
    ids = constellation.ids
    table: dict[str, Any] = {
        "name": f"emulated {parts.scenario.name}",
        "dimensions": constellation.dimensions,
        "heading": constellation.heading,
        "nodes": {n.id: _node(n) for n in constellation.nodes},
        "antennas": {
            a.id: {"node": a.node, "offset_m": list(a.offset_b)} for a in constellation.antennas
        },
        "links": {
            name: _link(wire, node.node, ids, folder / name, options.key)
            for node, names in nodes
            if only in (None, node.node)
            for wire, name in zip(node.formats, names, strict=True)
        },
        "cars": {
            node: _car(options, folder / car_port(node)) for node in ids if only in (None, node)
        },
        # Antennas of the scenarios are calibrated.
        "calibration": {"uncalibrated": True},
        "task": {
            "name": parts.config.task,
            "room": list(parts.scenario.room),
            "command": "link" if options.operator else "plan",
            "proximity": options.proximity,
            "options": _options(parts.task_options),
        },
        "tracker": {"filter": parts.config.filter, "delay": parts.params.horizon.delay},
        # The speed limit of the simulation.
        "safety": {"max_speed": MAX_SPEED},
    }
    if options.operator:
        link = {"port": str(folder / OPERATOR_PORT), "format": "relpos"}
        table["links"][OPERATOR_PORT] = _with_key(link, options.key)
    return f"{WRITTEN_BY}\n" + "\n".join(_lines(table, "")) + "\n"


OPERATOR_PORT = "operator"
WRITTEN_BY = "# Written by `relpos emulate`."
"""First line of the file."""


def node_port(node: int, k: int) -> str:
    """Return the name of the k-th port of a node."""
    return f"n{node}" if k == 0 else f"n{node}-{k + 1}"


def car_port(node: int) -> str:
    """Return the name of the port of the car that carries a node."""
    return f"car{node}"


def _node(node: NodeConfig) -> dict[str, Any]:
    """Return the table of a node."""
    table = {"vehicle": node.vehicle, "imu_hz": 1.0 / DT}
    return table if node.mount == Mount() else {**table, "mount": node.mount.table}


def _link(
    wire: WireFormat, node: int, ids: Sequence[int], port: Path, key: bytes | None
) -> dict[str, Any]:
    """Return the table of one link of a node."""
    link: dict[str, Any] = {"port": str(port), "format": wire.name}
    if not wire.names_itself:
        link["node"] = node
    names = {wire.name_of(each): each for each in ids}
    if any(name != str(each) for name, each in names.items()):
        link["ids"] = names
    return _with_key(link, key if wire.name == "relpos" else None)


def _car(options: EmulateOptions, port: Path) -> dict[str, Any]:
    """Return the table of one car."""
    watchdog = DEADMAN if options.deadman is None else options.deadman
    car: dict[str, Any] = {"port": str(port), "driver": options.driver}
    if watchdog <= SLOWEST_WATCHDOG:
        car["watchdog"] = watchdog
    if options.driver_options:
        car["options"] = _options(options.driver_options)
    return _with_key(car, options.car_key)


def _with_key(table: dict[str, Any], key: bytes | None) -> dict[str, Any]:
    return table if key is None else {**table, "key": key.hex()}


def _options(options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options that TOML can hold: booleans, numbers, strings and lists."""
    return {
        k: v for k, v in options.items() if isinstance(v, bool | int | float | str | list | tuple)
    }


def _lines(table: Mapping[Any, Any], path: str) -> list[str]:
    """Return the lines of a table in TOML: its values, then its tables."""
    lines = [f"{_key(k)} = {_value(v)}" for k, v in table.items() if not isinstance(v, Mapping)]
    for key, inner in table.items():
        if isinstance(inner, Mapping):
            name = f"{path}.{_key(key)}" if path else _key(key)
            head = (
                []
                if inner and all(isinstance(v, Mapping) for v in inner.values())
                else ["", f"[{name}]"]
            )
            lines += [*head, *_lines(inner, name)]
    return lines


def _key(key: Any) -> str:
    """Return a key in TOML, without quotes where allowed."""
    text = str(key)
    bare = text.isascii() and text.replace("-", "").replace("_", "").isalnum()
    return text if bare else _value(text)


def _value(value: Any) -> str:
    """Return a value in TOML."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, list | tuple):
        return f"[{', '.join(_value(v) for v in value)}]"
    escaped = "".join(
        c if c.isprintable() and c not in '"\\' else f"\\U{ord(c):08X}" for c in str(value)
    )
    return f'"{escaped}"'
