"""calibration.toml: a calibration as a file.

format = 1

[nodes.1]
gyr_offset_rad_s = [0.002, -0.001, 0.003]
acc_offset_m_s2 = [0.03, -0.02, 0.05]
acc_scale = [1.0, 1.0, 1.0]
mag_offset_uT = [12.0, -3.5, 8.1]
mag_matrix = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]

[ranges]
slope = 1.003

[ranges.offset_m]
1 = 0.18
2 = 0.17
"""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np

from tracking.calibration.calibration import (
    Calibration,
    Matrix,
    NodeCalibration,
    RangeCalibration,
    Vector,
)
from tracking.errors import ConfigError

FORMAT = 1
MOST = 1e12
"""Largest number accepted, in any unit."""
MOST_DIGITS = 18
"""Largest number of digits of an id."""
FIELDS = {
    "gyr_offset_rad_s": "gyr_offset",
    "acc_offset_m_s2": "acc_offset",
    "acc_scale": "acc_scale",
    "mag_offset_uT": "mag_offset",
    "mag_matrix": "mag_matrix",
}
"""Names in the file, with units, and in `NodeCalibration`."""


MOST_OFFSET = {"gyr_offset_rad_s": 1.0, "acc_offset_m_s2": 5.0}
"""Largest offsets; larger ones are in other units, or a defect."""
MOST_RANGE_OFFSET = 10.0
"""[m] Largest offset; a larger one is in other units, or a defect."""


def calibration_toml(calibration: Calibration) -> str:
    """Return a calibration as text; `read_calibration` restores it bit for bit."""
    lines = [f"format = {FORMAT}"]
    for node_id, node in sorted(calibration.nodes.items()):
        lines += ["", f"[nodes.{node_id}]"]
        for name, attribute in FIELDS.items():
            value = getattr(node, attribute)
            if value is not None:
                lines.append(f"{name} = {_toml(value)}")
    if calibration.ranges is not None:
        lines += ["", "[ranges]", f"slope = {_toml(calibration.ranges.slope)}"]
        lines += ["", "[ranges.offset_m]"]
        offsets = sorted(calibration.ranges.offset.items())
        lines += [f"{node_id} = {_toml(value)}" for node_id, value in offsets]
    return "\n".join(lines) + "\n"


def read_calibration(path: Path | str) -> Calibration:
    """Read and check a calibration.

    Raises:
        ConfigError: The message names the file and the field, the expected and the found. An
            unknown field is an error as well.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read ({error.strerror})") from error
    except UnicodeDecodeError as error:
        raise ConfigError(f"{path}: not TOML ({error})") from error
    return parse_calibration(text, str(path))


def parse_calibration(text: str, file: str) -> Calibration:
    """Parse a calibration.

    Args:
        text: Text as from `calibration_toml`.
        file: Name of the file, for messages.

    Raises:
        ConfigError: As in `read_calibration`.
    """
    try:
        raw = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise ConfigError(f"{file}: not TOML ({error})") from error
    try:
        return _calibration(raw)
    except ConfigError as error:
        raise ConfigError(f"{file}, {error}") from error


def _calibration(raw: dict[str, Any]) -> Calibration:
    _expect_keys("", raw, ("format", "nodes", "ranges"))
    if type(raw.get("format")) is not int or raw["format"] != FORMAT:
        raise ConfigError(f"format: expected {FORMAT}, found {raw.get('format')!r}")
    nodes: dict[int, NodeCalibration] = {}
    for key, table in _table("nodes", raw.get("nodes", {})).items():
        nodes[_id("nodes", key, nodes)] = _node(f"nodes.{key}", table)
    ranges = _ranges(_table("ranges", raw["ranges"])) if "ranges" in raw else None
    return Calibration(nodes=nodes, ranges=ranges)


def _node(where: str, table: Any) -> NodeCalibration:
    _expect_keys(f"{where}.", _table(where, table), FIELDS)
    given: dict[str, Any] = {}
    for name, value in table.items():
        field = f"{where}.{name}"
        given[FIELDS[name]] = _matrix(field, value) if "matrix" in name else _vector(field, value)
        most = MOST_OFFSET.get(name, MOST)
        if "matrix" not in name and not all(abs(v) <= most for v in given[FIELDS[name]]):
            raise ConfigError(f"{field}: expected numbers up to {most:g}, found {value!r}")
    if not all(0.5 <= s <= 2.0 for s in given.get("acc_scale", ())):
        raise ConfigError(
            f"{where}.acc_scale: expected numbers from 0.5 to 2, found {table['acc_scale']!r}"
        )
    return NodeCalibration(**given)


def _ranges(table: dict[str, Any]) -> RangeCalibration:
    _expect_keys("ranges.", table, ("slope", "offset_m"))
    slope = _number("ranges.slope", table.get("slope"))
    if not 0.5 <= slope <= 2.0:
        raise ConfigError(f"ranges.slope: expected 0.5 to 2, found {slope!r}")
    offset: dict[int, float] = {}
    for key, value in _table("ranges.offset_m", table.get("offset_m")).items():
        b = _number(f"ranges.offset_m.{key}", value)
        if abs(b) > MOST_RANGE_OFFSET:
            raise ConfigError(
                f"ranges.offset_m.{key}: expected up to {MOST_RANGE_OFFSET:g} m, found {value!r}"
            )
        offset[_id("ranges.offset_m", key, offset)] = b
    return RangeCalibration(slope=slope, offset=offset)


def _expect_keys(where: str, table: dict[str, Any], known: Any) -> None:
    for key in table:
        if key not in known:
            raise ConfigError(f"{where}{key}: unknown, expected one of {', '.join(known)}")


def _table(where: str, value: Any) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise ConfigError(f"{where}: expected a table, found {value!r}")
    return value


def _id(where: str, key: str, taken: dict[int, Any]) -> int:
    if not (key.isascii() and key.isdigit() and len(key) <= MOST_DIGITS):
        raise ConfigError(f"{where}.{key[:40]}: expected a node id")
    if int(key) in taken:
        raise ConfigError(f"{where}.{key}: node {int(key)} given twice, expected once")
    return int(key)


def _number(where: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < MOST:
        raise ConfigError(f"{where}: expected a number, found {str(value)[:40]}")
    return float(value)


def _vector(where: str, value: Any) -> Vector:
    if not isinstance(value, list) or len(value) != 3:
        raise ConfigError(f"{where}: expected three numbers, found {value!r}")
    x, y, z = (_number(where, v) for v in value)
    return x, y, z


def _matrix(where: str, value: Any) -> Matrix:
    if not isinstance(value, list) or len(value) != 3:
        raise ConfigError(f"{where}: expected three rows of three numbers, found {value!r}")
    x, y, z = (_vector(where, row) for row in value)
    if not np.linalg.det(np.array([x, y, z])) > 0.0:
        raise ConfigError(f"{where}: expected a positive determinant, found {value!r}")
    return x, y, z


def _toml(value: Any) -> str:
    if isinstance(value, tuple):
        return "[" + ", ".join(_toml(v) for v in value) + "]"
    return repr(float(value))
