"""Reading of a log folder.

Violations of the format (a missing column, an unknown node, text for a number, decreasing time)
are errors. A single impossible measurement (NaN, a negative or absurd range) is left out and
counted.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tracking.arrays import F64, I64, Bool
from tracking.constellation import Constellation
from tracking.errors import ConfigError, LogError
from tracking.log.folder import ACC, GYR, MAG, POWERS, QUAT, Log
from tracking.log.inertial import check_inertial, in_body_axes, with_rates
from tracking.log.meta import read_meta
from tracking.log.table import Table, find_table
from tracking.log.truth import Truth
from tracking.measurements import Kind, MeasurementBlock
from tracking.sanity.measurements import FARTHEST

MAX_GYR = 4000.0
"""[rad/s] Beyond any gyroscope's range, in deg/s too, which the finding `gyro-units` reports."""
MAX_ACC = 700.0
"""[m/s2] Beyond the range of usual accelerometers (16 g is 157)."""
MAX_POSITION = 1e5
"""[m] Largest distance of a true position from its origin."""
MAX_MAG = 5000.0
"""[uT] A hundred times the field of the earth."""
MOST_ID = 2.0**53
"""Largest id that a float represents exactly."""


def read_log(folder: Path | str) -> Log:
    """Read a recorded run.

    Raises:
        LogError: The message names the file and the row or field, the expected and the found.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise LogError(f"{folder}: no such folder, expected a log folder with meta.toml")
    meta = read_meta(folder / "meta.toml")
    constellation = meta.constellation
    skipped: dict[str, int] = {}
    ranges, nlos = _read_ranges(folder, constellation, skipped)
    imu = _read_imu(folder, constellation, skipped)
    blocks = [ranges, imu, *_read_optional(folder, constellation, skipped)]
    # RANGE events keep their order: the sort by time, kind and nodes is stable, and rows come in
    # time order. The labels must follow the same order.
    constellation, block = in_body_axes(constellation, MeasurementBlock.concatenate(blocks))
    order = np.lexsort((block.j[0], block.i[0], block.kind[0], block.t[0]))
    is_range = block.kind[0][order] == Kind.RANGE
    check_inertial(block, constellation)
    if nlos is not None:
        all_labels = np.zeros(block.n_events, dtype=bool)
        all_labels[: len(nlos)] = nlos
        nlos = all_labels[order][is_range]
    return Log(
        name=meta.name,
        source=meta.source,
        licence=meta.licence,
        constellation=with_rates(constellation, block),
        block=block.take(order),
        truth=_read_truth(folder, constellation, skipped),
        nlos=nlos,
        range_noise=meta.range_noise,
        accuracy=meta.accuracy,
        unused_keys=meta.unused_keys,
        skipped={name: n for name, n in skipped.items() if n},
    )


def _read_ranges(
    folder: Path, constellation: Constellation, skipped: dict[str, int]
) -> tuple[MeasurementBlock, Bool | None]:
    path = find_table(folder, "ranges")
    if path is None:
        raise LogError(f"{folder}: no ranges.csv or ranges.csv.gz")
    table = Table.read(path, ("t_s", "node_i", "node_j", "range_m"))
    if table.n_rows == 0:
        raise LogError(f"{path.name}: no rows, expected ranges")
    t = table.times()
    i, j = (table.nodes(c, constellation.index_of) for c in ("node_i", "node_j"))
    same = np.nonzero(i == j)[0]
    if len(same):
        raise LogError(f"{path.name} row {same[0] + 2}: a range needs two different nodes")
    distance, filled = table.numbers(("range_m",))
    d = distance[:, 0]
    with np.errstate(invalid="ignore"):
        good = filled[:, 0] & np.isfinite(d) & (d > 0.0) & (d <= FARTHEST)
    table.check_share(good, f"metres, above 0 and up to {FARTHEST:g}", ("range_m",))
    skipped[path.name] = int(np.sum(~good))
    survey = np.zeros(table.n_rows, dtype=bool)
    if "source" in table:
        for r, source in enumerate(table.text("source")):
            if source.strip() not in ("", "uwb", "survey"):
                raise LogError(
                    f"{path.name} row {r + 2}, source: expected 'uwb' or 'survey', found {source!r}"
                )
            survey[r] = source.strip() == "survey"
    values, has_power = np.zeros((table.n_rows, 3)), np.zeros(table.n_rows, dtype=bool)
    values[:, 0] = d
    if all(name in table for name in POWERS):
        powers, power_filled = table.numbers(POWERS)
        has_power = np.asarray(power_filled.all(axis=1) & np.isfinite(powers).all(axis=1))
        values[has_power, 1:] = powers[has_power]
    block = MeasurementBlock.of_kind(
        Kind.RANGE,
        t,
        i,
        values,
        j=j,
        antennas=_antennas(table, constellation, i, j),
        has_power=has_power,
    )
    block.kind[0, survey] = Kind.SURVEY
    if not np.any(good & ~survey):
        raise LogError(f"{path.name}: only surveyed distances, expected UWB ranges")
    moving = survey & ~(constellation.is_static[i] & constellation.is_static[j])
    if moving.any():
        raise LogError(
            f"{path.name} row {np.nonzero(moving)[0][0] + 2}, source: a surveyed distance needs "
            "two static nodes"
        )
    nlos = None
    if "nlos" in table:
        labels, label_filled = table.numbers(("nlos",))
        nlos = ((labels[:, 0] == 1.0) & label_filled[:, 0])[good]
    return block.take(good), nlos


def _antennas(table: Table, constellation: Constellation, i: I64, j: I64) -> tuple[I64, I64]:
    """Return the antenna indices of both ends of every range."""
    ends = []
    for column, nodes in (("antenna_i", i), ("antenna_j", j)):
        ids, filled = np.zeros((table.n_rows, 1)), np.zeros((table.n_rows, 1), dtype=bool)
        if column in table:
            ids, filled = table.numbers((column,))
        odd = np.nonzero(
            filled[:, 0] & ~((np.abs(ids[:, 0]) < MOST_ID) & (np.trunc(ids[:, 0]) == ids[:, 0]))
        )[0]
        if len(odd):
            raise LogError(
                f"{table.path.name} row {odd[0] + 2}, {column}: expected an antenna id, "
                f"found {table.text(column)[odd[0]]!r}"
            )
        known: dict[tuple[int, int | None], int] = {}
        index = np.empty(table.n_rows, dtype=np.int64)
        for r in range(table.n_rows):
            key = (int(nodes[r]), int(ids[r, 0]) if filled[r, 0] else None)
            if key not in known:
                try:
                    known[key] = constellation.antenna_index(constellation.ids[key[0]], key[1])
                except ConfigError as error:
                    raise LogError(f"{table.path.name} row {r + 2}, {column}: {error}") from error
            index[r] = known[key]
        ends.append(index)
    return ends[0], ends[1]


def _read_imu(
    folder: Path, constellation: Constellation, skipped: dict[str, int]
) -> MeasurementBlock:
    """Return the IMU and MAG events of imu.csv."""
    path = find_table(folder, "imu")
    if path is None:
        return MeasurementBlock.empty()
    table = Table.read(path, ("t_s", "node", *GYR, *ACC))
    if table.n_rows == 0:
        raise LogError(f"{path.name}: no rows, expected samples or no such file")
    t, node = table.times(), table.nodes("node", constellation.index_of)
    values, filled = table.numbers(GYR + ACC)
    good = _within(values, filled, np.repeat([MAX_GYR, MAX_ACC], 3))
    table.check_share(good, "rad/s and m/s2", GYR + ACC)
    skipped[path.name] = int(np.sum(~good))
    static = np.nonzero(constellation.is_static[node])[0]
    if len(static):
        raise LogError(
            f"{path.name} row {static[0] + 2}: node {constellation.ids[node[static[0]]]} is "
            "static in meta.toml and can have no IMU"
        )
    blocks = [MeasurementBlock.of_kind(Kind.IMU, t[good], node[good], values[good])]
    if all(name in table for name in MAG):
        mag, mag_filled = table.numbers(MAG)
        mag_good = good & _within(mag, mag_filled, np.full(3, MAX_MAG))
        skipped[path.name] += int(np.sum(good & mag_filled.all(axis=1) & ~mag_good))
        blocks.append(
            MeasurementBlock.of_kind(Kind.MAG, t[mag_good], node[mag_good], mag[mag_good])
        )
    return MeasurementBlock.concatenate(blocks)


def _read_optional(
    folder: Path, constellation: Constellation, skipped: dict[str, int]
) -> list[MeasurementBlock]:
    """Return the events of mag.csv, state.csv and members.csv."""
    blocks = _read_members(folder, constellation)
    for stem, kind, columns, limits in (
        ("mag", Kind.MAG, MAG, np.full(3, MAX_MAG)),
        ("state", Kind.STATE, (*QUAT, "ax", "ay", "az"), np.array([1.1] * 4 + [MAX_ACC] * 3)),
    ):
        path = find_table(folder, stem)
        if path is None:
            continue
        table = Table.read(path, ("t_s", "node", *columns))
        t, node = table.times(), table.nodes("node", constellation.index_of)
        values, filled = table.numbers(columns)
        good = _within(values, filled, limits)
        if kind == Kind.STATE:
            norm = np.linalg.norm(np.where(good[:, None], values[:, :4], 1.0), axis=1)
            good &= np.abs(norm - 1.0) < 0.05
            values[:, :4] /= np.where(good, norm, 1.0)[:, None]
        table.check_share(good, "finite values in range", columns)
        skipped[path.name] = int(np.sum(~good))
        blocks.append(MeasurementBlock.of_kind(kind, t[good], node[good], values[good]))
    return blocks


def _read_members(folder: Path, constellation: Constellation) -> list[MeasurementBlock]:
    """Return the JOIN and LEAVE events of members.csv."""
    path = find_table(folder, "members")
    if path is None:
        return []
    table = Table.read(path, ("t_s", "node", "joins"))
    t, node = table.times(), table.nodes("node", constellation.index_of)
    joins, filled = table.numbers(("joins",))
    wrong = np.flatnonzero(~(filled[:, 0] & np.isin(joins[:, 0], (0.0, 1.0))))
    if len(wrong):
        raise LogError(
            f"{path.name} row {wrong[0] + 2}, joins: expected 0 or 1, "
            f"found {table.text('joins')[wrong[0]]!r}"
        )
    none = np.zeros((table.n_rows, 1))
    return [
        MeasurementBlock.of_kind(kind, t[of], node[of], none[of])
        for kind, of in ((Kind.JOIN, joins[:, 0] == 1.0), (Kind.LEAVE, joins[:, 0] == 0.0))
    ]


def _read_truth(folder: Path, constellation: Constellation, skipped: dict[str, int]) -> Truth:
    path = find_table(folder, "truth")
    if path is None:
        return Truth.empty()
    table = Table.read(path, ("t_s", "node", "x", "y", "z", *QUAT))
    if table.n_rows == 0:
        raise LogError(f"{path.name}: no rows, expected true positions or no such file")
    t, node = table.times(), table.nodes("node", constellation.index_of)
    pos, filled = table.numbers(("x", "y", "z"))
    good = _within(pos, filled, np.full(3, MAX_POSITION))
    table.check_share(good, f"metres, at most {MAX_POSITION:g}", ("x", "y", "z"))
    skipped[path.name] = int(np.sum(~good))
    quat, quat_filled = table.numbers(QUAT)
    has_orientation: Bool = np.asarray(quat_filled.all(axis=1) & np.isfinite(quat).all(axis=1))
    valid = np.ones(table.n_rows, dtype=bool)
    if "valid" in table:
        flags, flag_filled = table.numbers(("valid",))
        valid = ~flag_filled[:, 0] | (flags[:, 0] != 0.0)
    quat = np.where(has_orientation[:, None], quat, 0.0)
    return Truth(t[good], node[good], pos[good], quat[good], has_orientation[good], valid[good])


def _within(values: F64, filled: Bool, limits: F64) -> Bool:
    """Return a mask of rows whose values are all present, finite and within the limits."""
    with np.errstate(invalid="ignore"):
        ok = filled & np.isfinite(values) & (np.abs(values) <= limits)
    return np.asarray(ok.all(axis=1))
