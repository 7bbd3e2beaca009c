"""What of a recording is what: a mapping file, or a preset of a public data set."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from agents.errors import UsageError
from tracking.log.meta import Meta, read_meta
from tracking.tables import TableReader, Where

FOLDER = Path(__file__).parent / "presets"
PRESETS = tuple(sorted(path.stem for path in FOLDER.glob("*.toml")))
OF_META = ("format", "name", "source", "licence", "dimensions", "heading", "nodes", "antennas")
"""Keys of meta.toml, which a mapping has as well."""


@dataclass(frozen=True, kw_only=True)
class Imu:
    """A stream of inertial samples."""

    stream: str
    """A topic or a file, parts of its name in braces: ``/robot{node}/imu``."""
    node: str = "node"
    """A number, a part of the name, or a field."""
    gyr: tuple[str, str, str]
    acc: tuple[str, str, str]
    gyr_scale: float = 1.0
    """To rad/s."""
    acc_scale: float = 1.0
    """To m/s2."""


@dataclass(frozen=True, kw_only=True)
class Mag:
    """A stream of magnetometer readings."""

    stream: str
    node: str = "node"
    mag: tuple[str, str, str]
    scale: float = 1.0
    """To uT."""


@dataclass(frozen=True, kw_only=True)
class Ranges:
    """A stream of ranges."""

    stream: str
    i: str = "i"
    j: str = "j"
    range: str
    scale: float = 1.0
    """To metres."""
    each: str = ""
    """A field that is a list, each of which is a range; other fields are looked for there first."""
    valid: str = ""
    """A field that is 0 where the range is not to be used."""
    rx_power: str = ""
    """[dBm]"""
    fp_power: str = ""
    antenna_i: str = ""
    antenna_j: str = ""


@dataclass(frozen=True, kw_only=True)
class Truth:
    """A stream of true poses."""

    stream: str
    node: str = "node"
    pos: tuple[str, str, str]
    quat: tuple[str, str, str, str] | None = None
    """w, x, y, z"""


@dataclass(frozen=True, kw_only=True)
class Mapping:
    """Which streams are read, and how."""

    kind: Literal["bag", "tables"]
    time: str
    """Field with the time of a record [s]; of bags `stamp` (of the header) or `receipt`."""
    ranges: tuple[Ranges, ...]
    imu: tuple[Imu, ...] = ()
    mag: tuple[Mag, ...] = ()
    truth: tuple[Truth, ...] = ()


@dataclass(frozen=True)
class Plan:
    """A mapping, the group, ids of nodes and places of those that never move."""

    mapping: Mapping
    meta: Meta
    ids: dict[str, int]
    """What the recording calls a node, and its id in the log where that differs."""
    places: dict[int, tuple[float, float, float]]
    """[m] Of static nodes, by id in the log: truth, and surveyed distances between them."""


def read_plan(preset: str | None, file: Path | None) -> Plan:
    """Read a mapping.

    Raises:
        UsageError: Neither or both are given, no such preset, or something in the file makes no
            sense; names the key.
    """
    if (preset is None) == (file is None):
        raise UsageError("--preset or --mapping: expected one of them")
    if preset is not None and preset not in PRESETS:
        raise UsageError(f"--preset: expected one of {', '.join(PRESETS)}, got {preset!r}")
    path = FOLDER / f"{preset}.toml" if file is None else file
    meta = read_meta(path)
    raw = tomllib.loads(path.read_text(encoding="utf-8"))
    ids, places = raw.pop("ids", {}), raw.pop("places", {})
    rest = {key: value for key, value in raw.items() if key not in OF_META}
    where = Where(path.name, raises=UsageError)
    mapping = TableReader().read(Mapping, rest, where)
    known = meta.constellation.ids
    for key, value in ids.items():
        if type(value) is not int or value not in known:
            raise where.key("ids").key(key).error(f"expected one of the nodes {known}")
    for key, value in places.items():
        right = isinstance(value, list) and len(value) == 3 and key.isdigit() and int(key) in known
        if not right or not all(isinstance(x, (int, float)) for x in value):
            raise where.key("places").key(key).error("expected a node of [nodes] and [x, y, z]")
    return Plan(mapping, meta, ids, {int(k): (v[0], v[1], v[2]) for k, v in places.items()})
