"""Mapping from the streams of a recording to measurements: a mapping file, or a preset."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import Any, Literal

from agents.errors import UsageError
from tracking.errors import LogError
from tracking.log.meta import Meta, read_meta
from tracking.params.tables import TableReader, Where

FOLDER = Path(__file__).parent / "presets"
PRESETS = tuple(sorted(path.stem for path in FOLDER.glob("*.toml")))
OF_META = ("format", "name", "source", "licence", "dimensions", "heading", "nodes", "antennas",
           "range_noise_m")  # fmt: skip
"""Keys of meta.toml that a mapping has as well."""
TABLES = ("imu", "mag", "state", "ranges", "truth")
"""Tables of a mapping, each with the entries of one kind."""
SCALES = ("scale", "gyr_scale", "acc_scale")
Fields = tuple[str, ...]
"""Names of fields whose numbers are concatenated; a minus before a name negates them."""


@dataclass(frozen=True, kw_only=True)
class Stream:
    """Keys of every kind of stream."""

    stream: str
    """Topic, file or array; braces mark variable parts of its name: ``/robot{node}/imu``."""
    rate: float = 0.0
    """[Hz] Record k has the time k / rate; 0 uses the time of the record."""


@dataclass(frozen=True, kw_only=True)
class Oriented(Stream):
    """Keys of streams with an orientation, body to world; at most one of them is given."""

    quat: Fields = ()
    """[-] Quaternion w, x, y, z."""
    matrix: Fields = ()
    """[-] Rotation matrix, row by row."""
    euler_deg: Fields = ()
    """[deg] Roll, pitch, yaw, applied in this order about the axes of the world."""
    yaw: Fields = ()
    """[rad] Yaw."""


@dataclass(frozen=True, kw_only=True)
class Imu(Stream):
    """Samples of a gyroscope and an accelerometer."""

    node: str = "node"
    """Node as a number, a variable part of the stream's name, or a field."""
    gyr: Fields
    acc: Fields
    gyr_scale: float = 1.0
    """Factor to rad/s."""
    acc_scale: float = 1.0
    """Factor to m/s2."""


@dataclass(frozen=True, kw_only=True)
class Mag(Stream):
    """Readings of a magnetometer."""

    node: str = "node"
    mag: Fields
    scale: float = 1.0
    """Factor to uT."""


@dataclass(frozen=True, kw_only=True)
class State(Oriented):
    """Orientations and accelerations from the attitude filter of a node."""

    node: str = "node"
    acc: Fields
    """[m/s2] Acceleration in the world frame, without gravity."""


@dataclass(frozen=True, kw_only=True)
class Ranges(Stream):
    """Ranges between nodes i and j."""

    i: str = "i"
    j: str = "j"
    range: str = ""
    mean_of: Fields = ()
    """Fields whose mean is the range; replaces `range`."""
    pairs: tuple[tuple[str, str], ...] = ()
    """Nodes of the ranges in a record, number by number; replaces `range`, `i` and `j`."""
    scale: float = 1.0
    """Factor to metres."""
    each: str = ""
    """Field with a list of ranges; other fields are looked up in its items first."""
    valid: str = ""
    """Field that is 0 for an invalid range."""
    rx_power: str = ""
    """[dBm] Received power."""
    fp_power: str = ""
    """[dBm] First-path power."""
    antenna_i: str = ""
    antenna_j: str = ""


@dataclass(frozen=True, kw_only=True)
class Truth(Oriented):
    """True poses."""

    node: str = "node"
    pos: Fields
    """[m] Position x, y or x, y, z."""


@dataclass(frozen=True, kw_only=True)
class Mapping:
    """Streams of a recording."""

    kind: Literal["bag", "tables", "arrays", "capture"]
    time: str = ""
    """[s] Field with the time of a record; in bags `stamp` (of the header) or `receipt`."""
    capture: str = ""
    """Serial format of a capture, such as `linktrack`."""
    up: Literal["z", "y"] = "z"
    """Axis of the recording's world frame that points up."""
    ranges: tuple[Ranges, ...] = ()
    imu: tuple[Imu, ...] = ()
    mag: tuple[Mag, ...] = ()
    state: tuple[State, ...] = ()
    truth: tuple[Truth, ...] = ()


@dataclass(frozen=True)
class Plan:
    """A mapping with the constellation, the ids of nodes and positions of static nodes."""

    mapping: Mapping
    meta: Meta
    ids: dict[str, int]
    """Id of a node in the log by its name in the recording, if they differ."""
    places: dict[int, tuple[float, float, float]]
    """[m] Positions of static nodes by id in the log, for truth and surveyed distances."""


OF_CAPTURES: dict[str, Any] = {
    "ranges": (
        Ranges(stream="ranges", range="distance", rx_power="rx_power", fp_power="fp_power"),
    ),
    "imu": (Imu(stream="imu", gyr=("gyr",), acc=("acc",)),),
}
"""Streams of every capture."""


def read_plan(preset: str | None, file: Path | None) -> Plan:
    """Read a mapping.

    Raises:
        UsageError: Neither or both are given, the preset is unknown, or a key is wrong.
    """
    if (preset is None) == (file is None):
        raise UsageError("--preset or --mapping: expected one of them")
    if preset is not None and preset not in PRESETS:
        raise UsageError(f"--preset: expected one of {', '.join(PRESETS)}, got {preset!r}")
    path = FOLDER / f"{preset}.toml" if file is None else file
    if not path.is_file():
        raise UsageError(f"--mapping: no such file, got {path}")
    try:
        meta = read_meta(path)
    except LogError as error:
        raise UsageError(str(error).replace("meta.toml", path.name, 1)) from error
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
    if mapping.kind != "capture" and not mapping.ranges:
        raise where.key("ranges").error("missing, expected [[ranges]]")
    _check_numbers(mapping, where)
    for k, ranges in enumerate(mapping.ranges):
        if bool(ranges.range) + bool(ranges.mean_of) + bool(ranges.pairs) != 1:
            raise where.key(f"ranges[{k}]").error("expected one of range, mean_of, pairs")
    return Plan(mapping, meta, ids, {int(k): (v[0], v[1], v[2]) for k, v in places.items()})


def _check_numbers(mapping: Mapping, where: Where) -> None:
    """Check that every stream has times, and that scales and rates are possible."""
    for table in TABLES:
        for k, item in enumerate(getattr(mapping, table)):
            at = where.key(f"{table}[{k}]")
            if not 0.0 <= item.rate < inf:
                raise at.key("rate").error(f"expected 0 or more Hz, got {item.rate:g}")
            if mapping.kind in ("tables", "arrays") and not (mapping.time or item.rate):
                raise where.key("time").error(
                    f"missing, expected the field with the time [s], or rate in [[{table}]]"
                )
            for key in SCALES:
                scale = getattr(item, key, 1.0)
                if not 0.0 < scale < inf:
                    raise at.key(key).error(f"expected a factor above 0, got {scale:g}")
