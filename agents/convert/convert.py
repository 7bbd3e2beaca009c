"""From the streams of a recording to the events of a log."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np

from agents.convert.mapping import Imu, Mag, Plan, Ranges, Truth, read_plan
from agents.convert.sources import Bag, Get, Record, Source, Tables, pattern
from agents.errors import UsageError
from tracking.arrays import F64
from tracking.errors import ConfigError
from tracking.log import Log, check_target, write_log
from tracking.log.truth import Truth as TruthRows
from tracking.measurements import Kind, MeasurementBlock

LONG_GAP = 10.0
"""[-] Periods of an IMU: after a longer silence another line is fitted."""


def convert(
    source: Path | str,
    out: Path | str | None = None,
    *,
    preset: str | None = None,
    mapping: Path | str | None = None,
    restamp: bool = False,
    progress: Callable[[float], None] | None = None,
) -> Log:
    """Read a recording and write it as a log folder.

    Args:
        source: A bag, or a folder of a bag of ROS 2 or of tables.
        out: Folder to write; None writes nothing.
        preset: One of `PRESETS`.
        mapping: A mapping file, where there is no preset.
        restamp: Times of IMU samples are replaced by those of a steady rate.
        progress: Called with the share of streams done.

    Raises:
        UsageError: The recording or the mapping cannot be read, or lacks something; names it.
        LogError: The folder cannot be written.
    """
    plan = read_plan(preset, None if mapping is None else Path(mapping))
    if out is not None:
        check_target(Path(out))
    path = Path(source)
    if not path.exists():
        raise UsageError(f"{path}: no such file or folder")
    kind: type[Tables] | type[Bag] = Tables if plan.mapping.kind == "tables" else Bag
    with closing(kind(path, plan.mapping.time)) as opened:
        log = _read(plan, opened, restamp, progress or (lambda _: None))
    if out is not None:
        write_log(out, log)
    return log


def _read(plan: Plan, source: Source, restamp: bool, progress: Callable[[float], None]) -> Log:
    m, group = plan.mapping, plan.meta.constellation
    items: list[Any] = [*m.imu, *m.mag, *m.ranges, *m.truth]
    rows: dict[str, list[tuple[float, ...]]] = {"imu": [], "mag": [], "ranges": [], "truth": []}
    for k, item in enumerate(items):
        found = [(name, pattern(item.stream).match(name)) for name in source.names()]
        matched = {name: match.groupdict() for name, match in found if match}
        if not matched:
            raise UsageError(f"stream {item.stream!r}: not in the recording")
        for record in source.records(list(matched)):
            if np.isfinite(record.t):
                _take(rows, plan, item, record, matched[record.stream])
        progress((k + 1) / len(items))
    if not rows["ranges"]:
        raise UsageError("ranges: expected some in the recording, found none")
    tables = {name: np.array(sorted(of), dtype=np.float64) for name, of in rows.items() if of}
    start = min(float(of[0, 0]) for of in tables.values())
    for of in tables.values():
        of[:, 0] -= start  # times of an epoch would lose digits
    if restamp and "imu" in tables:
        tables["imu"] = _evenly(tables["imu"])
    blocks = [_surveys(plan, float(tables["ranges"][0, 0]))]
    for name, what, width in (("imu", Kind.IMU, 6), ("mag", Kind.MAG, 3)):
        if name in tables:
            t, node, values = tables[name][:, 0], tables[name][:, 1], tables[name][:, 2 : 2 + width]
            blocks.append(MeasurementBlock.of_kind(what, t, node.astype(np.int64), values))
    blocks.append(_ranges(tables["ranges"]))
    block = MeasurementBlock.concatenate(blocks)
    return Log(
        name=plan.meta.name,
        source=plan.meta.source,
        licence=plan.meta.licence,
        constellation=group,
        block=block.take(block.order()[0]),
        truth=_truth(plan, tables.get("truth")),
    )


def _take(
    rows: dict[str, list[tuple[float, ...]]],
    plan: Plan,
    item: Imu | Mag | Ranges | Truth,
    record: Record,
    parts: dict[str, str],
) -> None:
    """Add what one record says; what has no number is left out."""
    try:
        if isinstance(item, Ranges):
            for get in _each(item.each, record.get):
                row = _range(plan, item, get, parts)
                if row is not None:
                    rows["ranges"].append((record.t, *row))
            return
        node = _index(plan, item.node, record.get, parts)
        if node is None:
            return
        if isinstance(item, Imu):
            gyr, acc = _numbers(record.get, item.gyr), _numbers(record.get, item.acc)
            values = [item.gyr_scale * v for v in gyr] + [item.acc_scale * v for v in acc]
            rows["imu"].append((record.t, node, *values))
        elif isinstance(item, Mag):
            values = [item.scale * v for v in _numbers(record.get, item.mag)]
            rows["mag"].append((record.t, node, *values))
        else:
            quat = _numbers(record.get, item.quat) if item.quat else [np.nan] * 4
            rows["truth"].append((record.t, node, *_numbers(record.get, item.pos), *quat))
    except KeyError as error:
        raise UsageError(f"stream {record.stream!r}: no field {error.args[0]!r}") from error


def _each(name: str, get: Get) -> Iterable[Get]:
    """The record itself, or each of a list in it."""
    if not name:
        return [get]

    def inner(one: Any) -> Get:
        return lambda path: getattr(one, path) if hasattr(one, path) else get(path)

    return [inner(one) for one in get(name)]


def _range(plan: Plan, item: Ranges, get: Get, parts: dict[str, str]) -> tuple[float, ...] | None:
    i, j = (_index(plan, ref, get, parts) for ref in (item.i, item.j))
    metres = item.scale * float(get(item.range) or "nan")
    if i is None or j is None or i == j or not (np.isfinite(metres) and metres > 0.0):
        return None
    if item.valid and not float(get(item.valid)):
        return None
    group, ends = plan.meta.constellation, []
    for node, ref in ((i, item.antenna_i), (j, item.antenna_j)):
        named = int(float(get(ref))) if ref else None
        own = [a.id for a in group.all_antennas if a.node == group.ids[node]]
        try:
            ends.append(group.antenna_index(group.ids[node], named if named in own else None))
        except ConfigError as error:
            raise UsageError(f"antennas: {error}") from error
    powers = [float(get(p)) if p else np.nan for p in (item.rx_power, item.fp_power)]
    return (i, j, metres, *powers, *ends)


def _index(plan: Plan, ref: str, get: Get, parts: dict[str, str]) -> int | None:
    """Array index of a node; None for one that the mapping leaves out."""
    value = parts[ref] if ref in parts else ref if ref.lstrip("-").isdigit() else get(ref)
    name = str(int(value)) if not isinstance(value, str) else value.strip()
    node = plan.ids.get(name, int(name) if name.isdigit() else None)
    return plan.meta.constellation.index_of.get(node) if node is not None else None


def _numbers(get: Get, names: tuple[str, ...]) -> list[float]:
    return [float(get(name)) for name in names]


def _ranges(rows: F64) -> MeasurementBlock:
    i, j, antenna_i, antenna_j = (rows[:, k].astype(np.int64) for k in (1, 2, 6, 7))
    has_power = np.asarray(np.isfinite(rows[:, 4:6]).all(axis=1))
    values = np.where(np.isfinite(rows[:, 3:6]), rows[:, 3:6], 0.0)
    return MeasurementBlock.of_kind(
        Kind.RANGE,
        rows[:, 0],
        i,
        values,
        j=j,
        antennas=(antenna_i, antenna_j),
        has_power=has_power,
    )


def _surveys(plan: Plan, t: float) -> MeasurementBlock:
    """Distances between the nodes whose places are given, at the first range."""
    group, places = plan.meta.constellation, plan.places
    known = [k for k, node in enumerate(group.ids) if node in places]
    pairs = np.array([(a, b) for a in known for b in known if a < b]).reshape(-1, 2)
    ends = [np.array([places[group.ids[k]] for k in of]).reshape(-1, 3) for of in pairs.T]
    metres = np.linalg.norm(ends[0] - ends[1], axis=1)[:, None]
    antennas = [np.array([group.antenna_index(group.ids[k], None) for k in of]) for of in pairs.T]
    return MeasurementBlock.of_kind(
        Kind.SURVEY,
        np.full(len(pairs), t),
        pairs[:, 0].astype(np.int64),
        metres,
        j=pairs[:, 1].astype(np.int64),
        antennas=(antennas[0].astype(np.int64), antennas[1].astype(np.int64)),
    )


def _truth(plan: Plan, rows: F64 | None) -> TruthRows:
    group = plan.meta.constellation
    fixed = [
        (0.0, k, *plan.places[node], 1.0, 0.0, 0.0, 0.0)
        for k, node in enumerate(group.ids)
        if node in plan.places
    ]
    parts = [np.array(fixed).reshape(-1, 9), np.zeros((0, 9)) if rows is None else rows]
    every = np.concatenate(parts)
    every = every[np.lexsort((every[:, 1], every[:, 0]))]
    has_q = np.isfinite(every[:, 5:9]).all(axis=1)
    return TruthRows(
        every[:, 0],
        every[:, 1].astype(np.int64),
        every[:, 2:5],
        np.where(has_q[:, None], every[:, 5:9], 0.0),
        has_q,
        np.ones(len(every), dtype=bool),
    )


def _evenly(rows: F64) -> F64:
    """Samples of each node at its steady rate: repeats and jitter of their stamps are gone."""
    out = []
    for node in np.unique(rows[:, 1]):
        own = rows[rows[:, 1] == node].copy()
        steps = np.diff(own[:, 0])
        period = float(np.median(steps[steps > 0.0])) if (steps > 0.0).any() else 0.0
        cuts = np.nonzero(steps > LONG_GAP * period)[0] + 1
        for part in np.split(own, cuts):
            if len(part) > 2 and period > 0.0:
                # As many samples as came: a line through their times, by their numbers.
                k = np.arange(len(part), dtype=np.float64)
                slope, first = np.polyfit(k, part[:, 0], 1)
                part[:, 0] = first + slope * k
            out.append(part)
    every = np.concatenate(out)
    return every[np.lexsort((every[:, 1], every[:, 0]))]
