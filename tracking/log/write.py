"""Writing of a log folder, complete or not at all."""

from __future__ import annotations

import csv
import gzip
import io
import os
import shutil
import tempfile
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from tracking.errors import LogError
from tracking.log.folder import ACC, FORMAT, GYR, MAG, POWERS, QUAT, Log
from tracking.measurements import Kind, MeasurementBlock
from tracking.mount import Mount

TABLES = ("ranges", "imu", "mag", "state", "members", "truth")
"""Tables of a log, files with the suffix .csv or .csv.gz."""


def write_log(folder: Path | str, log: Log, *, overwrite: bool = False) -> Path:
    """Write a run so that `read_log` returns the same measurements, bit for bit.

    The files are written next to the target and moved there at the end.

    Args:
        folder: New or empty folder.
        log: The run.
        overwrite: Whether the folder may hold a log, which is replaced; it may hold no other file.

    Raises:
        LogError: The target exists and is not such a folder, or cannot be written to.
    """
    check_target(Path(folder), overwrite=overwrite)
    folder = Path(folder).resolve()  # `.` has no name, and a folder cannot replace a link
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        scratch = Path(tempfile.mkdtemp(prefix=f".{folder.name}-", dir=folder.parent))
    except OSError as error:
        raise LogError(f"{folder}: cannot be written to ({error.strerror})") from error
    try:
        (scratch / "meta.toml").write_text(_meta(log), encoding="utf-8")
        for stem, header, rows in _tables(log):
            text = io.StringIO()
            writer = csv.writer(text, lineterminator="\n")
            writer.writerow(header)
            writer.writerows(rows)
            # Without a time stamp, equal runs give equal bytes.
            packed = gzip.compress(text.getvalue().encode(), compresslevel=6, mtime=0)
            (scratch / f"{stem}.csv.gz").write_bytes(packed)
        scratch.chmod(0o755)
        _put(scratch, folder)
    except BaseException:
        shutil.rmtree(scratch, ignore_errors=True)
        raise
    return folder


def check_target(folder: Path, *, overwrite: bool = False) -> None:
    """Check that a log can be written to a folder.

    Args:
        folder: Target folder.
        overwrite: Whether it may hold a log and nothing else.

    Raises:
        LogError: The folder exists and is not empty, or its parent is unusable.
    """
    try:
        taken = folder.exists() and (not folder.is_dir() or any(folder.iterdir()))
        is_log = taken and folder.is_dir() and all(map(_is_of_log, folder.iterdir()))
    except OSError as error:
        raise LogError(f"{folder}: cannot be written to ({error.strerror})") from error
    if taken and not (overwrite and is_log):
        more = " or one with nothing but a log" if overwrite else ""
        expected = f"a new or empty folder{more}"
        raise LogError(f"{folder}: exists already, expected {expected}")
    parent = next(p for p in folder.absolute().parents if p.exists())
    if not parent.is_dir():
        raise LogError(f"{folder}: {parent} is not a folder")
    if not os.access(parent, os.W_OK):
        raise LogError(f"{folder}: {parent} cannot be written to")


def _is_of_log(path: Path) -> bool:
    """Return whether a file has the name of one that a log consists of."""
    stem = path.name.removesuffix(".gz").removesuffix(".csv")
    is_table = path.name in (f"{stem}.csv", f"{stem}.csv.gz") and stem in TABLES
    return path.is_file() and (is_table or path.name == "meta.toml")


def _put(scratch: Path, folder: Path) -> None:
    """Move a finished folder into place; a log that is there goes last."""
    if not folder.exists():
        scratch.rename(folder)
        return
    aside = scratch.with_name(f"{scratch.name}-old")
    folder.rename(aside)
    try:
        scratch.rename(folder)
    except OSError:
        aside.rename(folder)
        raise
    shutil.rmtree(aside, ignore_errors=True)


def _meta(log: Log) -> str:
    c = log.constellation
    lines = [
        f"format = {FORMAT}",
        f"name = {_quoted(log.name)}",
        f"source = {_quoted(log.source)}",
        f"licence = {_quoted(log.licence)}",
        f"dimensions = {c.dimensions}",
        f"heading = {_quoted(c.heading)}",
    ]
    if log.range_noise is not None:
        lines.append(f"range_noise_m = {float(log.range_noise)!r}")
    if log.accuracy is not None:
        lines.append(f"accuracy_m = {float(log.accuracy)!r}")
    for node in c.nodes:
        lines += ["", f"[nodes.{node.id}]", f'kind = "{node.kind}"', f'vehicle = "{node.vehicle}"']
        if node.initial_heading is not None:
            lines.append(f"initial_heading_rad = {float(node.initial_heading)!r}")
        if node.mount != Mount():
            lines += ["", f"[nodes.{node.id}.mount]"]
            lines += [f"{key} = {value!r}" for key, value in node.mount.table.items()]
    for antenna in c.antennas:
        offset = ", ".join(repr(float(v)) for v in antenna.offset_b)
        lines += ["", f"[antennas.{antenna.id}]", f"node = {antenna.node}"]
        lines.append(f"offset_m = [{offset}]")
    return "\n".join(lines) + "\n"


def _quoted(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return '"' + "".join(ch if " " <= ch != "\x7f" else f"\\u{ord(ch):04x}" for ch in escaped) + '"'


def _tables(log: Log) -> Iterable[tuple[str, Sequence[str], list[list[object]]]]:
    """Yield name, header and rows of every file that the run needs."""
    block = log.block
    ids = np.array(log.constellation.ids)
    member = block.take(block.valid[0] & np.isin(block.kind[0], (Kind.JOIN, Kind.LEAVE)))
    if member.n_events:
        joins = (member.kind[0] == Kind.JOIN).astype(np.int64)[:, None]
        yield "members", ["t_s", "node", "joins"], _rows(member, ids, joins)
    yield "ranges", *_ranges(log, ids)
    imu, mag = (_of_kind(block, kind) for kind in (Kind.IMU, Kind.MAG))
    # One row if every sample has its own magnetometer reading, else a separate file.
    together = imu.t.shape == mag.t.shape and bool(
        np.array_equal(imu.t, mag.t) and np.array_equal(imu.i, mag.i)
    )
    values = imu.values[0, :, :6]
    if imu.n_events:
        header = ["t_s", "node", *GYR, *ACC]
        if together:
            header += MAG
            values = np.concatenate([values, mag.values[0, :, :3]], axis=1)
        yield "imu", header, _rows(imu, ids, values)
    if mag.n_events and not together:
        yield "mag", ["t_s", "node", *MAG], _rows(mag, ids, mag.values[0, :, :3])
    state = _of_kind(block, Kind.STATE)
    if state.n_events:
        yield (
            "state",
            ["t_s", "node", *QUAT, "ax", "ay", "az"],
            _rows(state, ids, state.values[0, :, :7]),
        )
    truth = log.truth
    if len(truth.t):
        rows: list[list[object]] = []
        for k in range(len(truth.t)):
            quat = truth.q_wb[k].tolist() if truth.has_orientation[k] else [""] * 4
            row = [float(truth.t[k]), int(ids[truth.node[k]]), *truth.pos_w[k].tolist(), *quat]
            rows.append([*row, int(truth.valid[k])])
        yield "truth", ["t_s", "node", "x", "y", "z", *QUAT, "valid"], rows


def _ranges(log: Log, ids: np.ndarray) -> tuple[list[str], list[list[object]]]:
    """Return header and rows of ranges.csv."""
    block = log.block
    chosen = block.valid[0] & np.isin(block.kind[0], (Kind.RANGE, Kind.SURVEY))
    r = block.take(chosen)
    header = ["t_s", "node_i", "node_j", "range_m", *POWERS, "source"]
    named = bool(log.constellation.antennas)
    if named:
        header += ["antenna_i", "antenna_j"]
    if log.nlos is not None:
        header.append("nlos")
    antenna_ids = ["" if a.id < 0 else a.id for a in log.constellation.all_antennas]
    labels = iter(() if log.nlos is None else log.nlos)
    rows: list[list[object]] = []
    for k in range(r.n_events):
        is_range = r.kind[0, k] == Kind.RANGE
        row: list[object] = [float(r.t[0, k]), int(ids[r.i[0, k]]), int(ids[r.j[0, k]])]
        row.append(float(r.values[0, k, 0]))
        row += r.values[0, k, 1:3].tolist() if r.has_power[0, k] else ["", ""]
        row.append("uwb" if is_range else "survey")
        if named:
            row += [antenna_ids[r.antenna_i[0, k]], antenna_ids[r.antenna_j[0, k]]]
        if log.nlos is not None:
            row.append(int(next(labels)) if is_range else "")
        rows.append(row)
    return header, rows


def _of_kind(block: MeasurementBlock, kind: Kind) -> MeasurementBlock:
    return block.take(block.valid[0] & (block.kind[0] == kind))


def _rows(block: MeasurementBlock, ids: np.ndarray, values: np.ndarray) -> list[list[object]]:
    """Return rows of time, node and values; floats are written to read back exactly."""
    return [
        [t, int(ids[i]), *row]
        for t, i, row in zip(block.t[0].tolist(), block.i[0], values.tolist(), strict=True)
    ]
