"""``[links.NAME]`` and ``[cars.ID]``: ports of the nodes and cars."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import pi
from pathlib import Path
from typing import Any

from hardware_bridge.config.keys import check_node, node_id, tables_of, without
from hardware_bridge.config.swarm import CarConfig, LinkConfig
from hardware_bridge.errors import BridgeError
from hardware_bridge.ingest.scanner import ScannerMount
from hardware_bridge.links.ports import PortSpec
from hardware_bridge.readings import ScanReading
from hardware_bridge.wire.key import parse_key
from tracking.constellation import Constellation
from tracking.params.tables import TableReader, Where

SLOWEST_WATCHDOG = 2.0
"""[s] Longest accepted watchdog time."""
MOST_CELLS = 14


@dataclass(frozen=True, kw_only=True)
class _Link:
    port: str
    format: str
    baud: int | None = None
    node: int | None = None
    key: str | None = None
    scanner: ScannerMount = ScannerMount()


@dataclass(frozen=True, kw_only=True)
class _Car:
    port: str
    driver: str
    baud: int | None = None
    key: str | None = None
    watchdog: float | None = None
    cells: int = 0


def read_links(
    raw: Mapping[str, Any], group: Constellation, where: Where, folder: Path
) -> Iterator[LinkConfig]:
    """Read the links with measurements; relative paths start from `folder`."""
    from hardware_bridge.decoders import DECODERS

    for key, table in tables_of(raw, "links", where):
        at = where.key("links").key(key)
        rest, ids = without(table, "ids", at)
        link = TableReader().read(_Link, rest, at, others=("ids",))
        if link.format not in DECODERS:
            known = ", ".join(DECODERS)
            raise at.key("format").error(f"expected one of {known}, got {link.format!r}")
        entry = DECODERS[link.format]
        named = {str(device).upper(): node for device, node in ids.items()}
        for device, node in named.items():
            check_node(node, group, at.key("ids").key(device))
        if len(set(named.values())) < len(named):
            raise at.key("ids").error("two devices are the same node")
        if link.node is not None and link.key is not None:
            raise at.key("node").error("signed messages name their sender, leave it out")
        if link.node is not None:
            check_node(link.node, group, at.key("node"))
        elif not (entry.names_itself or entry.tells_of_others):
            raise at.key("node").error(f"missing: {link.format} does not name the sender")
        is_scanner = ScanReading in entry.tells
        if is_scanner:
            _check_scanner(link, named, raw, group, at)
        elif "scanner" in table:
            raise at.key("scanner").error(f"{link.format} is no scanner, leave it out")
        yield LinkConfig(
            name=key,
            port=PortSpec(
                name=f"links.{key}",
                port=_placed(link.port, folder, at),
                baud=_baud(link.baud, entry.baud, at),
                request=entry.request,
                dtr=entry.dtr,
            ),
            format=link.format,
            node=link.node,
            ids=named,
            key=_key(link.key, at),
            scanner=link.scanner if is_scanner else None,
        )


def _check_scanner(
    link: _Link, ids: Mapping[str, int], raw: Mapping[str, Any], group: Constellation, where: Where
) -> None:
    """Refuse a scanner that serves no purpose or has an impossible mounting position."""
    at, mount = where.key("scanner"), link.scanner
    for name, most in (("length", 5.0), ("width", 5.0)):
        if not 0.01 <= getattr(mount, name) <= most:
            value = getattr(mount, name)
            raise at.key(name).error(f"expected 0.01 to {most:g} m, got {value:g}")
    for name, most in (("x", mount.length), ("y", mount.width), ("yaw", 2.0 * pi)):
        if not abs(getattr(mount, name)) <= most:
            unit, value = "rad" if name == "yaw" else "m", getattr(mount, name)
            raise at.key(name).error(f"expected -{most:g} to {most:g} {unit}, got {value:g}")
    if ids:
        raise where.key("ids").error("a scanner names nothing, leave it out")
    if link.node is not None and group.is_static[group.index_of[link.node]]:
        raise where.key("node").error(f"node {link.node} is static, expected that of a car")
    if not raw.get("task", {}).get("proximity"):
        raise (
            Where(where.file, raises=BridgeError)
            .key("task")
            .key("proximity")
            .error("expected the number of distance sensors that a scanner replaces, 1 to 32")
        )


def read_cars(
    raw: Mapping[str, Any], group: Constellation, where: Where, folder: Path
) -> list[CarConfig]:
    """Read the cars, in the order of their nodes; relative paths start from `folder`."""
    from hardware_bridge.drivers import driver_entry, driver_options

    cars = []
    for key, table in tables_of(raw, "cars", where):
        at = where.key("cars").key(key)
        rest, options = without(table, "options", at)
        car, node = TableReader().read(_Car, rest, at, others=("options",)), node_id(key, at)
        check_node(node, group, at)
        if group.is_static[group.index_of[node]]:
            raise at.error(f"node {node} is static, expected one that moves")
        key_bytes = _key(car.key, at)
        try:
            entry = driver_entry(car.driver, node)
            driver_options(car.driver, node, options, key_bytes)
        except BridgeError as error:
            raise Where(where.file, raises=BridgeError).error(str(error)) from error
        if car.watchdog is not None and not 0.0 < car.watchdog <= SLOWEST_WATCHDOG:
            raise at.key("watchdog").error(
                f"expected above 0 and at most {SLOWEST_WATCHDOG:g} s, got {car.watchdog:g}: a car "
                "that goes on for longer must be set up otherwise"
            )
        if not 0 <= car.cells <= MOST_CELLS:
            raise at.key("cells").error(f"expected 0 to {MOST_CELLS}, got {car.cells}")
        baud = _baud(car.baud, entry.baud, at)
        port = _placed(car.port, folder, at)
        spec = PortSpec(name=f"cars.{node}", port=port, baud=baud)
        cars.append(
            CarConfig(
                node=node,
                port=spec,
                driver=car.driver,
                options=options,
                key=key_bytes,
                watchdog=car.watchdog,
                cells=car.cells,
            )
        )
    return sorted(cars, key=lambda each: group.index_of[each.node])


def _baud(given: int | None, usual: int, where: Where) -> int:
    if given is not None and given < 1:
        raise where.key("baud").error(f"expected above 0, got {given}")
    return usual if given is None else given


def _placed(port: str, folder: Path, where: Where) -> str:
    """Return a port; the path of a file starts from the folder of the configuration."""
    if not port or "\0" in port:
        raise where.key("port").error(f"expected the name of a port, got {port!r}")
    if not port.startswith("file:"):
        return port
    name = port.removeprefix("file:")
    if not name:
        raise where.key("port").error("expected file:path")
    return f"file:{folder / name}"


def _key(text: str | None, where: Where) -> bytes | None:
    try:
        return parse_key(text)
    except ValueError as error:
        raise where.key("key").error(str(error)) from error
