"""meta.toml: description of a log and its nodes."""

from __future__ import annotations

import re
import tomllib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from tracking.axes import Axes
from tracking.constellation import Antenna, Constellation, NodeConfig
from tracking.errors import ConfigError, LogError
from tracking.log.folder import FORMAT
from tracking.mount import KEYS, Mount

MOST = 1e12
"""Largest number accepted, in any unit."""
MOST_DIGITS = 18
"""Largest number of digits of an id."""
LEAST_NOISE, MOST_NOISE = 1e-3, 10.0
"""[m] Limits of the white noise of ranges; beyond, the unit is wrong."""
LEAST_ACCURACY, MOST_ACCURACY = 0.01, 10.0
"""[m] Accuracies that can be asked for."""
TOP = ("format", "name", "source", "licence", "dimensions", "heading", "range_noise_m",
       "accuracy_m", "nodes", "antennas")  # fmt: skip
"""Keys above the tables."""
TABLES = {
    "nodes": ("kind", "vehicle", "initial_heading_rad", "mount", "imu_axes", "mag_axes"),
    "antennas": ("node", "offset_m"),
}
"""Keys of the tables of each node and antenna."""
MAX_OFFSET = 100.0
"""[m] Largest offset of an antenna from its body's origin; beyond, the unit is wrong."""


@dataclass(frozen=True, slots=True)
class Meta:
    """The contents of meta.toml."""

    name: str
    source: str
    licence: str
    constellation: Constellation
    range_noise: float | None = None
    """[m] As `Log.range_noise`."""
    accuracy: float | None = None
    """[m] As of `Log.accuracy`."""
    unused_keys: tuple[str, ...] = ()
    """Keys that are not read, with their tables."""


def read_meta(path: Path) -> Meta:
    """Read and check meta.toml.

    Raises:
        LogError: The file is missing or not TOML, or a field is missing or invalid.
    """
    if not path.is_file():
        raise LogError(f"{path.parent}: no meta.toml, expected a log folder")
    try:
        raw = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except (ValueError, OSError, RecursionError) as error:
        raise LogError(f"meta.toml: not TOML ({error})") from error
    if type(raw.get("format")) is not int or raw["format"] != FORMAT:
        raise LogError(f"meta.toml, format: expected {FORMAT}, found {raw.get('format')!r}")
    nodes = raw.get("nodes")
    if not isinstance(nodes, dict) or not nodes:
        raise LogError("meta.toml, nodes: expected a table [nodes.ID] for each node")
    antennas = raw.get("antennas", {})
    if not isinstance(antennas, dict):
        raise LogError("meta.toml, antennas: expected a table [antennas.ID] for each antenna")
    dimensions: Any = raw.get("dimensions", 3)
    heading: Any = raw.get("heading", "magnetic")
    if type(dimensions) is not int or dimensions not in (2, 3):
        raise LogError(f"meta.toml, dimensions: expected 2 or 3, found {dimensions!r}")
    try:
        constellation = Constellation(
            nodes=tuple(_node(key, table) for key, table in nodes.items()),
            dimensions=2 if dimensions == 2 else 3,
            heading=heading,
            antennas=tuple(_antenna(key, table) for key, table in antennas.items()),
        )
    except ConfigError as error:
        raise LogError(f"meta.toml, {error}") from error
    return Meta(
        name=_text("name", raw.get("name", path.parent.name)),
        source=_text("source", raw.get("source", "")),
        licence=_text("licence", raw.get("licence", "")),
        constellation=constellation,
        range_noise=_within("range_noise_m", raw, LEAST_NOISE, MOST_NOISE),
        accuracy=_within("accuracy_m", raw, LEAST_ACCURACY, MOST_ACCURACY),
        unused_keys=_unused_keys(raw),
    )


def _unused_keys(raw: dict[str, Any]) -> tuple[str, ...]:
    """Return the keys that are not read, such as misspelt ones."""
    found = [key for key in raw if key not in TOP]
    for name, known in TABLES.items():
        for number, table in raw.get(name, {}).items():
            found += [f"{name}.{number}.{key}" for key in table if key not in known]
    return tuple(found)


def write_range_noise(folder: Path | str, noise: float) -> None:
    """Write `range_noise_m` to the meta.toml of a log; the rest of the file stays as it is.

    Args:
        folder: Log folder.
        noise: White noise of its ranges [m]; rounded to 0.1 mm.

    Raises:
        LogError: The file cannot be read or written; it is then unchanged.
    """
    path, value = Path(folder) / "meta.toml", round(noise, 4)
    before = read_meta(path)
    scratch = path.with_name(f".{path.name}.new")
    try:
        head, rest = _split_tables(path.read_text(encoding="utf-8-sig"))
        kept = [row for row in head if not re.match(r"\s*range_noise_m\s*=", row)]
        while kept and not kept[-1].strip():
            kept.pop()
        lines = [*kept, f"range_noise_m = {value!r}", "", *rest]
        scratch.write_text("\n".join(lines) + "\n", encoding="utf-8")
        if read_meta(scratch) != replace(before, range_noise=value):
            raise LogError(f"{path}: write range_noise_m = {value!r} by hand, above the tables")
        scratch.replace(path)
    except OSError as error:
        raise LogError(f"{path}: cannot be written to ({error.strerror})") from error
    finally:
        scratch.unlink(missing_ok=True)


def _split_tables(text: str) -> tuple[list[str], list[str]]:
    """Lines before the first table of a TOML text, and from it on."""
    lines = text.splitlines()
    first = next((k for k, row in enumerate(lines) if row.lstrip().startswith("[")), len(lines))
    return lines[:first], lines[first:]


def _within(key: str, raw: dict[str, Any], least: float, most: float) -> float | None:
    value = raw.get(key)
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise LogError(f"meta.toml, {key}: expected a number, found {value!r}")
    if not least <= value <= most:
        raise LogError(f"meta.toml, {key}: expected {least:g} to {most:g}, found {value!r}")
    return float(value)


def _text(where: str, value: Any) -> str:
    if not isinstance(value, str):
        raise LogError(f"meta.toml, {where}: expected text, found {value!r}")
    return value


def _node(key: str, table: Any) -> NodeConfig:
    where = f"nodes.{key}"
    heading = _table(where, table).get("initial_heading_rad")
    return NodeConfig(
        id=_id(where, key),
        kind=table.get("kind", "moving"),
        vehicle=table.get("vehicle", "none"),
        initial_heading=None
        if heading is None
        else _number(f"{where}.initial_heading_rad", heading),
        mount=_mount(f"{where}.mount", table.get("mount", {})),
        imu_axes=_axes(f"{where}.imu_axes", table.get("imu_axes"), mirrored=False),
        mag_axes=_axes(f"{where}.mag_axes", table.get("mag_axes"), mirrored=True),
    )


def _axes(where: str, value: Any, *, mirrored: bool) -> Axes:
    if value is None:
        return Axes()
    if not isinstance(value, list) or not all(isinstance(name, str) for name in value):
        raise LogError(f'meta.toml, {where}: expected ["x", "y", "z"], found {value!r}')
    try:
        return Axes.parse(value, mirrored=mirrored)
    except ConfigError as error:
        raise LogError(f"meta.toml, {where}: {error}") from error


def _mount(where: str, table: Any) -> Mount:
    unknown = set(_table(where, table)) - set(KEYS)
    if unknown:
        raise LogError(
            f"meta.toml, {where}: expected {', '.join(KEYS)}, found {', '.join(sorted(unknown))}"
        )
    return Mount(**{KEYS[key]: _number(f"{where}.{key}", v) for key, v in table.items()})


def _antenna(key: str, table: Any) -> Antenna:
    where = f"antennas.{key}"
    offset = _table(where, table).get("offset_m")
    if not isinstance(offset, list) or len(offset) != 3:
        raise LogError(f"meta.toml, {where}.offset_m: expected three numbers, found {offset!r}")
    x, y, z = (_number(f"{where}.offset_m", v) for v in offset)
    if max(abs(x), abs(y), abs(z)) > MAX_OFFSET:
        raise LogError(
            f"meta.toml, {where}.offset_m: expected at most {MAX_OFFSET:g} m, found {offset!r}"
        )
    return Antenna(
        id=_id(where, key), node=_id(f"{where}.node", table.get("node")), offset_b=(x, y, z)
    )


def _table(where: str, value: Any) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise LogError(f"meta.toml, {where}: expected a table, found {value!r}")
    return value


def _id(where: str, value: Any) -> int:
    text = value.strip() if isinstance(value, str) else value
    if isinstance(text, str) and text.isascii() and text.isdigit() and len(text) <= MOST_DIGITS:
        return int(text)
    if isinstance(text, int) and not isinstance(text, bool) and text >= 0:
        return text
    raise LogError(f"meta.toml, {where}: expected an integer id, found {str(value)[:40]!r}")


def _number(where: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < MOST:
        raise LogError(f"meta.toml, {where}: expected a number, found {str(value)[:40]}")
    return float(value)
