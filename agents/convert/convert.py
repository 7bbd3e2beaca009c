"""Conversion of a recording to a log folder."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from agents.convert.arrays import Arrays
from agents.convert.bags import Bag
from agents.convert.captures import Capture
from agents.convert.log import build_log, check_log
from agents.convert.mapping import OF_CAPTURES, TABLES, Mapping, Plan, read_plan
from agents.convert.rows import read_rows
from agents.convert.sources import Record, Source, pattern
from agents.convert.tables import Tables
from agents.errors import UsageError
from tracking.arrays import F64
from tracking.errors import ConfigError, LogError
from tracking.log import Log, check_target, write_log
from tracking.measurements import Kind

KINDS: dict[str, Callable[[Path, Mapping], Source]] = {
    "bag": lambda path, mapping: Bag(path, mapping.time),
    "tables": lambda path, mapping: Tables(path, mapping.time),
    "arrays": lambda path, mapping: Arrays(path, mapping.time),
    "capture": lambda path, mapping: Capture(path, mapping.capture),
}
"""Reader by kind of recording."""


@dataclass(frozen=True, slots=True)
class StreamUse:
    """What became of one entry of a mapping."""

    table: str
    """`imu`, `mag`, `state`, `ranges` or `truth`."""
    streams: tuple[str, ...]
    """Streams of the recording that match the entry."""
    rows: int
    left_out: int
    """Measurements of nodes that the mapping omits, invalid ones, or with missing numbers."""


@dataclass(frozen=True, slots=True)
class Conversion:
    """A converted recording."""

    log: Log
    used: tuple[StreamUse, ...]
    unused: tuple[str, ...]
    """Streams of the recording that the mapping does not name."""

    @property
    def unsurveyed(self) -> tuple[int, ...]:
        """Ids of static nodes, if there are several without known distances between them."""
        group = self.log.constellation
        static = tuple(node.id for node in group.nodes if node.kind == "static")
        known = (self.log.block.kind[0] == Kind.SURVEY).any()
        return static if len(static) > 1 and not known else ()


def convert(
    source: Path | str,
    out: Path | str | None = None,
    *,
    preset: str | None = None,
    mapping: Path | str | None = None,
    restamp: bool = False,
    overwrite: bool = False,
    progress: Callable[[float], None] | None = None,
) -> Conversion:
    """Read a recording and write it as a log folder.

    Args:
        source: A bag, a folder of tables, a file of arrays or a capture of a port.
        out: Folder to write; None writes nothing.
        preset: One of `PRESETS`.
        mapping: A mapping file, if there is no preset.
        restamp: Replace the times of IMU samples by those of a steady rate.
        overwrite: Whether a log in that folder is replaced.
        progress: Called with the share of streams done, 0 to 1.

    Raises:
        UsageError: The recording or the mapping cannot be read or is incomplete.
        LogError: The folder cannot be written.
    """
    plan = read_plan(preset, None if mapping is None else Path(mapping))
    if out is not None:
        check_target(Path(out), overwrite=overwrite)
    path = Path(source)
    if not path.exists():
        raise UsageError(f"{path}: no such file or folder")
    with closing(KINDS[plan.mapping.kind](path, plan.mapping)) as opened:
        if plan.mapping.kind == "capture":
            plan = _with_streams(plan, opened.names())
        tables, used = _read(plan, opened, progress or (lambda _: None))
        taken = {stream for use in used for stream in use.streams}
        unused = tuple(name for name in opened.names() if name not in taken)
    if "ranges" not in tables:
        left_out = sum(use.left_out for use in used if use.table == "ranges")
        text = f"found none and {left_out} that are invalid or of other nodes"
        raise UsageError(f"ranges: expected some between nodes of the mapping, {text}")
    try:
        log = build_log(plan, tables, restamp)
        check_log(log)
    except (ConfigError, LogError) as error:
        raise UsageError(str(error)) from error
    if out is not None:
        write_log(out, log, overwrite=overwrite)
    return Conversion(log, tuple(used), unused)


def _with_streams(plan: Plan, names: list[str]) -> Plan:
    """Return the plan with the default streams of a capture for those that the mapping omits."""
    found: dict[str, Any] = {k: v for k, v in OF_CAPTURES.items() if k in names}
    found = {k: v for k, v in found.items() if not getattr(plan.mapping, k)}
    return replace(plan, mapping=replace(plan.mapping, **found))


def _noted(records: Iterable[Record], seen: set[str]) -> Iterator[Record]:
    """Yield records, and add their streams to a set."""
    for record in records:
        seen.add(record.stream)
        yield record


def _read(
    plan: Plan, source: Source, progress: Callable[[float], None]
) -> tuple[dict[str, F64], list[StreamUse]]:
    """Return the rows of each table that is not empty, and what became of each entry."""
    items = [(name, item) for name in TABLES for item in getattr(plan.mapping, name)]
    parts: dict[str, list[F64]] = {}
    used = []
    for k, (name, item) in enumerate(items):
        found = [(stream, pattern(item.stream).match(stream)) for stream in source.names()]
        matched = {stream: match.groupdict() for stream, match in found if match}
        if not matched:
            has = ", ".join(source.names())
            raise UsageError(
                f"[[{name}]] stream: expected one of the recording, which has {has}; "
                f"got {item.stream!r}"
            )
        seen = set[str]()
        rows = read_rows(plan, item, _noted(source.records(list(matched)), seen), matched)
        for stream in matched:
            if stream not in seen:
                raise UsageError(f"[[{name}]] {stream}: expected rows, found none")
        used.append(StreamUse(name, tuple(matched), len(rows.values), rows.left_out))
        if len(rows.values):
            parts.setdefault(name, []).append(rows.values)
        progress((k + 1) / len(items))
    return {name: np.concatenate(rows) for name, rows in parts.items()}, used
