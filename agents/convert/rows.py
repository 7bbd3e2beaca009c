"""Conversion of records to rows of numbers in SI units."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from agents.convert.mapping import Fields, Imu, Mag, Oriented, Plan, Ranges, State, Truth
from agents.convert.sources import Get, Record
from agents.errors import UsageError
from tracking.arrays import F64, Bool

Item = Imu | Mag | Ranges | State | Truth
Y_UP_TO_Z_UP = Rotation.from_rotvec([np.pi / 2.0, 0.0, 0.0])


class Rows(NamedTuple):
    """Rows of one entry of a mapping."""

    values: F64
    """(row, column), see `read_rows`."""
    left_out: int
    """Measurements left out: of other nodes, invalid, or with missing numbers."""


def read_rows(
    plan: Plan, item: Item, records: Iterable[Record], parts: dict[str, dict[str, str]]
) -> Rows:
    """Read the records of one entry of a mapping.

    Args:
        plan: The mapping.
        item: The entry.
        records: Records of the entry.
        parts: Variable parts of the stream's name, by stream.

    Returns:
        (row, column): t [s], then for an IMU: node, gyroscope [rad/s] (3), accelerometer [m/s2]
        (3); for a magnetometer: node, field [uT] (3); for a state: node, w x y z, acceleration
        [m/s2] (3); for ranges: i, j, range [m], received and first-path power [dBm], antennas of i
        and j; for truth: node, position [m] (3), w x y z. Nodes and antennas are ids; -1 is an
        unspecified antenna. Records with missing numbers are left out, except for powers and
        orientations of truth.

    Raises:
        UsageError: A field is missing or has a wrong number of elements.
    """
    rows: list[list[float]] = []
    left_out = 0
    for record in records:
        t = record.k / item.rate if item.rate else record.t
        try:
            for row in _rows(plan, item, record.get, parts[record.stream]):
                if row is None:
                    left_out += 1
                else:
                    rows.append([t, *row])
        except KeyError as error:
            raise UsageError(f"stream {record.stream!r}: no field {error.args[0]!r}") from error
        except (UsageError, TypeError, ValueError) as error:
            where = f"stream {record.stream!r}, record {record.k + 1}"
            raise UsageError(f"{where}: {error}") from error
    found = np.array(rows, dtype=np.float64)
    if not len(found):
        return Rows(found, left_out)
    if isinstance(item, (State, Truth)):
        found = _oriented(item, found, plan.mapping.up == "y")
    needed = found[:, :4] if isinstance(item, Ranges) else found
    if isinstance(item, Truth):
        needed = found[:, :5]
    whole = np.isfinite(needed).all(axis=1)
    return Rows(np.asarray(found[whole]), left_out + int((~whole).sum()))


def _rows(plan: Plan, item: Item, get: Get, parts: dict[str, str]) -> Iterator[list[float] | None]:
    """Yield the measurements of a record; None for one that is left out."""
    if isinstance(item, Ranges):
        for one in _each(item.each, get):
            yield from _ranges(plan, item, one, parts)
        return
    node = _node(plan, item.node, get, parts)
    if node is None:
        yield None
    elif isinstance(item, Imu):
        gyr, acc = _numbers(get, item, "gyr", 3), _numbers(get, item, "acc", 3)
        yield [node, *(item.gyr_scale * v for v in gyr), *(item.acc_scale * v for v in acc)]
    elif isinstance(item, Mag):
        yield [node, *(item.scale * v for v in _numbers(get, item, "mag", 3))]
    elif isinstance(item, State):
        yield [node, *_numbers(get, item, "acc", 3), *_orientation(get, item)]
    else:
        pos = _numbers(get, item, "pos", 2 if len(item.pos) == 2 else 3)
        yield [node, *pos, *([0.0] if len(pos) == 2 else []), *_orientation(get, item)]


def _each(name: str, get: Get) -> Iterable[Get]:
    """Return accessors of the record itself, or of the items of a list in it."""
    if not name:
        return [get]

    def inner(one: Any) -> Get:
        return lambda path: getattr(one, path) if hasattr(one, path) else get(path)

    return [inner(one) for one in get(name)]


def _ranges(
    plan: Plan, item: Ranges, get: Get, parts: dict[str, str]
) -> Iterator[list[float] | None]:
    if item.pairs:
        for (i, j), metres in zip(item.pairs, _every_number(get), strict=False):
            ends = _node(plan, i, get, parts), _node(plan, j, get, parts)
            yield _range(plan, item, get, ends, metres)
        return
    if item.valid and not float(get(item.valid)):
        yield None
        return
    metres = (
        float(np.mean(_numbers(get, item, "mean_of", len(item.mean_of))))
        if item.mean_of
        else _number(get(item.range))
    )
    ends = _node(plan, item.i, get, parts), _node(plan, item.j, get, parts)
    yield _range(plan, item, get, ends, metres)


def _every_number(get: Get) -> list[float]:
    """Return the numbers of an array row, or of the fields named 0, 1, ..."""
    found: list[float] = []
    try:
        while True:
            found.append(_number(get(str(len(found)))))
    except KeyError:
        return found


def _range(
    plan: Plan, item: Ranges, get: Get, nodes: tuple[int | None, int | None], metres: float
) -> list[float] | None:
    i, j = nodes
    metres *= item.scale
    if i is None or j is None or i == j or not metres > 0.0:
        return None
    antennas = []
    for node, ref in ((i, item.antenna_i), (j, item.antenna_j)):
        named = int(float(get(ref))) if ref else -1
        own = [a.id for a in plan.meta.constellation.antennas if a.node == node]
        antennas.append(named if named in own else -1)
    powers = [_number(get(p)) if p else np.nan for p in (item.rx_power, item.fp_power)]
    return [i, j, metres, *powers, *antennas]


def _node(plan: Plan, ref: str, get: Get, parts: dict[str, str]) -> int | None:
    """Return the id of a node; None if the mapping does not include it."""
    value = parts[ref] if ref in parts else ref if ref.isdigit() else get(ref)
    name = str(int(value)) if not isinstance(value, str) else value.strip()
    node = plan.ids.get(name, int(name) if name.isdigit() else None)
    return node if node in plan.meta.constellation.index_of else None


def _numbers(get: Get, item: Item, key: str, n: int) -> list[float]:
    """Return the concatenated numbers of the fields of a key."""
    names: Fields = getattr(item, key)
    found: list[float] = []
    for name in names:
        sign, value = -1.0 if name.startswith("-") else 1.0, get(name.removeprefix("-"))
        numbers = [_number(value)] if isinstance(value, str) else np.ravel(value).tolist()
        found += [sign * number for number in numbers]
    if len(found) != n:
        raise UsageError(f"{key}: expected {n} numbers, got {len(found)}")
    return found


def _number(value: Any) -> float:
    if value == "":
        return float("nan")
    try:
        return float(value)
    except (TypeError, ValueError):
        raise UsageError(f"expected a number, found {str(value)[:40]!r}") from None


def _orientation(get: Get, item: State | Truth) -> list[float]:
    for key, n in (("quat", 4), ("matrix", 9), ("euler_deg", 3), ("yaw", 1)):
        if getattr(item, key):
            return _numbers(get, item, key, n)
    return []


def _oriented(item: Oriented, rows: F64, y_up: bool) -> F64:
    """Convert the orientation after a vector to w x y z, in a world with the z axis up.

    Returns:
        (row, column): t, node, then w x y z and vector for states, vector and w x y z for truth.
    """
    head, vector, found = rows[:, :2], rows[:, 2:5], rows[:, 5:]
    quat = np.full((len(rows), 4), np.nan)
    known: Bool = np.asarray(np.isfinite(found).all(axis=1))
    if item.quat:
        known &= np.linalg.norm(found, axis=1) > 0.0
        turns = Rotation.from_quat(found[known][:, [1, 2, 3, 0]])
    elif item.matrix:
        turns = Rotation.from_matrix(found[known].reshape(-1, 3, 3))
    elif item.euler_deg:
        turns = Rotation.from_euler("xyz", found[known], degrees=True)
    elif item.yaw:
        turns = Rotation.from_rotvec(found[known] * [0.0, 0.0, 1.0])
    else:
        known[:] = False
        turns = Rotation.identity(0)
    if y_up:
        vector = Y_UP_TO_Z_UP.apply(vector)
        turns = Y_UP_TO_Z_UP * turns if len(turns) else turns
    if known.any():
        quat[known] = turns.as_quat()[:, [3, 0, 1, 2]]
    parts = (head, quat, vector) if isinstance(item, State) else (head, vector, quat)
    return np.concatenate(parts, axis=1)
