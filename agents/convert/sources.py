"""Streams of records in bags of ROS and in folders of tables, both read alike."""

from __future__ import annotations

import csv
import gzip
import io
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from agents.errors import UsageError

Get = Callable[[str], Any]


class Record(NamedTuple):
    """One message or row."""

    stream: str
    t: float
    """[s]"""
    get: Get
    """Its fields by name; KeyError for one that it has not."""


class Source(Protocol):
    """A recording."""

    def names(self) -> list[str]:
        """Its streams."""

    def records(self, names: list[str]) -> Iterator[Record]:
        """What is in some of them."""

    def close(self) -> None:
        """Close its files."""


class Tables:
    """A folder of CSV files, compressed or not; streams are their names without an ending."""

    def __init__(self, folder: Path, time: str) -> None:
        self._files = {
            path.name.removesuffix(".gz").removesuffix(".csv"): path
            for path in sorted(folder.glob("*.csv*"))
        }
        self._time = time
        if not self._files:
            raise UsageError(f"{folder}: expected a folder with CSV files")

    def names(self) -> list[str]:
        """Names of the files."""
        return list(self._files)

    def records(self, names: list[str]) -> Iterator[Record]:
        """Rows, file after file."""
        for name in names:
            path = self._files[name]
            data = gzip.decompress(path.read_bytes()) if path.suffix == ".gz" else path.read_bytes()
            for row in csv.DictReader(io.StringIO(data.decode("utf-8-sig"))):
                if self._time not in row:
                    raise UsageError(f"{path.name}: no column {self._time!r}, found {[*row]}")
                yield Record(name, float(row[self._time] or "nan"), row.__getitem__)

    def close(self) -> None:
        """Nothing stays open."""


class Bag:
    """A bag of ROS 1 or ROS 2."""

    def __init__(self, path: Path, time: str) -> None:
        try:
            from rosbags.highlevel import AnyReader, AnyReaderError
            from rosbags.typesys import Stores, get_typestore
        except ImportError as error:
            raise UsageError(
                "rosbags is not installed: pip install 'relpos-env[convert]'"
            ) from error
        store = get_typestore(Stores.ROS2_HUMBLE) if path.is_dir() else None
        self._by_receipt = time == "receipt"
        try:
            self._reader = AnyReader([path], default_typestore=store)
            self._reader.open()
        except (AnyReaderError, OSError) as error:
            raise UsageError(f"{path}: no bag that can be read ({error})") from error

    def names(self) -> list[str]:
        """Topics."""
        return [connection.topic for connection in self._reader.connections]

    def records(self, names: list[str]) -> Iterator[Record]:
        """Messages in the order in which they came."""
        wanted = [c for c in self._reader.connections if c.topic in names]
        for connection, receipt, raw in self._reader.messages(connections=wanted):
            message = self._reader.deserialize(raw, connection.msgtype)
            t = 1e-9 * receipt
            if not self._by_receipt and hasattr(message, "header"):
                stamp = message.header.stamp
                t = stamp.sec + 1e-9 * stamp.nanosec
            yield Record(connection.topic, t, getter(message))

    def close(self) -> None:
        """Close its files."""
        self._reader.close()


def getter(message: Any) -> Get:
    """Fields of a message by their path: ``pose.position.x``."""

    def get(path: str) -> Any:
        value = message
        for part in path.split("."):
            if not hasattr(value, part):
                raise KeyError(path)
            value = getattr(value, part)
        return value

    return get


def pattern(stream: str) -> re.Pattern[str]:
    """What a stream's name must match; parts in braces are named groups."""
    parts = re.split(r"\{(\w+)\}", stream)
    text = "".join(
        re.escape(part) if k % 2 == 0 else f"(?P<{part}>[^/]+?)" for k, part in enumerate(parts)
    )
    return re.compile(f"{text}$")
