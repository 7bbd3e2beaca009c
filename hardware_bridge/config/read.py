"""Reading of swarm.toml; invalid values are errors that name the file and the key."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from hardware_bridge.config.keys import check_node, without
from hardware_bridge.config.nodes import read_constellation
from hardware_bridge.config.streams import read_cars, read_links
from hardware_bridge.config.swarm import SwarmConfig, TaskConfig, TrackerConfig
from hardware_bridge.errors import BridgeError
from hardware_bridge.safety.params import SafetyParams
from hardware_bridge.wire.key import REMOVED_KEY
from relpos_env.errors import EnvError
from relpos_env.interface.rangefinders import MAX_RANGEFINDERS
from relpos_env.tasks import TASKS, make_task
from tracking.constellation import Constellation
from tracking.errors import ConfigError
from tracking.filters import FILTERS, filter_builder
from tracking.log.meta import LEAST_ACCURACY, MOST_ACCURACY
from tracking.params.tables import TableReader, Where

SECTIONS = (
    "name", "dimensions", "heading", "nodes", "antennas", "links", "cars", "calibration", "task",
    "tracker", "safety",
)  # fmt: skip
MOST_SLOTS = 20
LARGEST_ROOM = 1000.0
"""[m] Largest side of the room."""


@dataclass(frozen=True, kw_only=True)
class _Head:
    name: str = ""
    dimensions: int = 2
    heading: Literal["magnetic", "initial"] = "magnetic"


@dataclass(frozen=True, kw_only=True)
class _Calibration:
    files: tuple[str, ...] = ()
    uncalibrated: bool = False
    uncalibrated_ranges: bool = False


def read_config(path: Path | str) -> SwarmConfig:
    """Read a swarm.toml.

    Raises:
        BridgeError: The file cannot be read, or a key is unknown, missing or invalid; the message
            names the file and the key.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise BridgeError(f"{path}: cannot be read ({error.strerror})") from error
    except UnicodeDecodeError as error:
        raise BridgeError(f"{path.name}: expected TOML, found bytes that are no text") from error
    config = parse_config(text, file=path.name, folder=path.parent)
    return replace(config, marks=path.with_suffix(".marks.json")) if any(config.keys) else config


def parse_config(text: str, *, file: str, folder: Path, with_files: bool = True) -> SwarmConfig:
    """Return the configuration in a text.

    Args:
        text: Content of a swarm.toml.
        file: Name of the file, for messages.
        folder: Base folder of relative paths.
        with_files: True if named files must exist and named third-party modules may be imported;
            False for the configuration in a recording.

    Raises:
        BridgeError: The configuration is invalid, as for `read_config`.
    """
    try:
        raw = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise BridgeError(f"{file}: expected TOML: {error}") from error
    where = Where(file, raises=BridgeError)
    for key in raw:
        if key not in SECTIONS:
            raise where.key(key).error(f"unknown, expected one of {', '.join(SECTIONS)}")
    reader = TableReader()
    head = reader.read(
        _Head, {k: raw[k] for k in ("name", "dimensions", "heading") if k in raw}, where
    )
    constellation = read_constellation(raw, head.dimensions, head.heading, where)
    calibration, uncalibrated_ranges = _calibration(raw, where, folder, with_files)
    config = SwarmConfig(
        name=head.name or Path(file).stem,
        constellation=constellation,
        links=tuple(read_links(raw, constellation, where, folder)),
        cars=tuple(read_cars(raw, constellation, where, folder)),
        calibration=calibration,
        uncalibrated_ranges=uncalibrated_ranges,
        task=_task(raw, constellation, where, with_files),
        tracker=reader.read(TrackerConfig, raw.get("tracker", {}), where.key("tracker")),
        safety=reader.read(SafetyParams, raw.get("safety", {}), where.key("safety")),
        text=text,
    )
    _check(config, where, with_files)
    return config


def _calibration(
    raw: Mapping[str, Any], where: Where, folder: Path, with_files: bool
) -> tuple[tuple[Path, ...] | None, bool]:
    """Return the calibration files and whether uncalibrated ranges are allowed."""
    if "calibration" not in raw:
        return None, False
    at = where.key("calibration")
    table = TableReader().read(_Calibration, raw["calibration"], at)
    files = tuple(folder / name for name in table.files)
    for path in files:
        if with_files and not path.is_file():
            raise at.key("files").error(f"no file {path}: make one with `relpos calibrate`")
    if bool(files) == table.uncalibrated:
        raise at.error("expected either files, or uncalibrated = true")
    return files, table.uncalibrated_ranges


def _task(
    raw: Mapping[str, Any], group: Constellation, where: Where, with_files: bool
) -> TaskConfig:
    at = where.key("task")
    rest, options = without(raw.get("task", {}), "options", at)
    config = replace(TableReader().read(TaskConfig, rest, at), options=options)
    if not all(0.0 < side <= LARGEST_ROOM for side in config.room):
        raise at.key("room").error(
            f"expected above 0 and at most {LARGEST_ROOM:g} m a side, got {list(config.room)}"
        )
    if not 0 <= config.proximity <= MAX_RANGEFINDERS:
        raise at.key("proximity").error(f"expected 0 to {MAX_RANGEFINDERS}, got {config.proximity}")
    if not (with_files or config.name in TASKS):
        raise at.key("name").error(f"expected one of {', '.join(TASKS)}, got {config.name!r}")
    n = int((~group.is_static).sum())
    if 2 <= n <= MOST_SLOTS:
        try:
            make_task(config.name, n, 1, config.room, **config.options)
        except EnvError as error:
            raise at.error(str(error)) from error
    return config


def _check(config: SwarmConfig, where: Where, with_files: bool) -> None:
    """Check conditions that involve several sections."""
    n = config.n_slots
    if not 2 <= n <= MOST_SLOTS:
        raise where.key("nodes").error(f"expected 2 to {MOST_SLOTS} that move, got {n}")
    if not config.links:
        raise where.key("links").error("missing, expected at least one [links.NAME]")
    ports: dict[str, str] = {}
    for spec in (*(link.port for link in config.links), *(car.port for car in config.cars)):
        if spec.port in ports:
            raise (
                where.key(spec.name)
                .key("port")
                .error(f"{spec.port} is that of {ports[spec.port]} already")
            )
        ports[spec.port] = spec.name
    name = config.tracker.filter
    if not (with_files or name in FILTERS):
        at = where.key("tracker").key("filter")
        raise at.error(f"expected one of {', '.join(FILTERS)}, got {name!r}")
    try:
        filter_builder(name)
    except ConfigError as error:
        raise where.key("tracker").error(str(error)) from error
    if not 0.0 <= config.tracker.delay <= 1.0:
        raise where.key("tracker").key("delay").error("expected 0 to 1 s")
    accuracy = config.tracker.accuracy
    if accuracy is not None and not LEAST_ACCURACY <= accuracy <= MOST_ACCURACY:
        message = f"expected {LEAST_ACCURACY:g} to {MOST_ACCURACY:g} m, got {accuracy:g}"
        raise where.key("tracker").key("accuracy").error(message)
    _check_keys(config, where)
    _check_source(config, where)
    fence, group = config.safety.fence, config.constellation
    if fence is not None:
        at = where.key("safety").key("fence").key("node")
        check_node(fence.node, group, at)
        if not group.is_static[group.index_of[fence.node]]:
            raise at.error(f"node {fence.node} moves, expected a static one")


def _check_keys(config: SwarmConfig, where: Where) -> None:
    """Refuse a key shared by a node and a car.

    A controller and the node on its car have one id: with a shared key a message of one would be
    accepted from the other when replayed on the other's line.
    """
    links = {link.key: link.port.name for link in config.links if link.key is not None}
    for car in config.cars:
        if car.key in links and car.key != REMOVED_KEY:
            at = where.key(car.port.name).key("key")
            raise at.error(f"is that of {links[car.key]}, expected one that only cars have")


def _check_source(config: SwarmConfig, where: Where) -> None:
    """Check that the source of positions fits the links, and that initial headings are given."""
    formats = {link.format for link in config.links}
    ready = config.tracker.source == "positions"
    group = config.constellation
    for node in group.nodes if group.heading == "initial" and not ready else ():
        if node.kind == "moving" and node.initial_heading is None:
            at = where.key("nodes").key(str(node.id)).key("initial_heading_rad")
            raise at.error('missing, expected where heading = "initial": nothing else tells it')
    if ready and "positions" not in formats:
        at = where.key("tracker").key("source")
        raise at.error('"positions" needs a link with format = "positions"')
    if not ready and "positions" in formats:
        at = where.key("tracker").key("source")
        raise at.error('a link has format = "positions": expected source = "positions"')
