"""A bag of ROS 1 or ROS 2."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from agents.convert.sources import Get, Record
from agents.errors import UsageError


class Bag:
    """Source with topics as streams."""

    def __init__(self, path: Path, time: str) -> None:
        """Open the bag.

        Args:
            path: ROS 1 file or ROS 2 folder.
            time: ``stamp`` for the stamp of the header, ``receipt`` for the time of receipt.

        Raises:
            UsageError: `rosbags` is not installed, or the bag cannot be read.
        """
        try:
            from rosbags.highlevel import AnyReader, AnyReaderError
            from rosbags.typesys import Stores, get_typestore
        except ImportError as error:
            raise UsageError(
                "rosbags is not installed: pip install -e '.[convert]' in its source folder"
            ) from error
        store = get_typestore(Stores.ROS2_HUMBLE) if path.is_dir() else None
        self._by_receipt = time == "receipt"
        try:
            self._reader = AnyReader([path], default_typestore=store)
            self._reader.open()
        except (AnyReaderError, OSError) as error:
            raise UsageError(f"{path}: no bag that can be read ({error})") from error

    def names(self) -> list[str]:
        """Return the topics."""
        return [connection.topic for connection in self._reader.connections]

    def records(self, names: list[str]) -> Iterator[Record]:
        """Yield the messages of some topics in the order of receipt."""
        selected = [c for c in self._reader.connections if c.topic in names]
        counts: Counter[str] = Counter()
        for connection, receipt, raw in self._reader.messages(connections=selected):
            message = self._reader.deserialize(raw, connection.msgtype)
            t = 1e-9 * receipt
            if not self._by_receipt and hasattr(message, "header"):
                stamp = message.header.stamp
                t = stamp.sec + 1e-9 * stamp.nanosec
            yield Record(connection.topic, counts[connection.topic], t, getter(message))
            counts[connection.topic] += 1

    def close(self) -> None:
        """Close the bag."""
        self._reader.close()


def getter(message: Any) -> Get:
    """Return a function that reads a field of a message by its path: ``pose.position.x``."""

    def get(path: str) -> Any:
        value = message
        for part in path.split("."):
            if not hasattr(value, part):
                raise KeyError(path)
            value = getattr(value, part)
        return value

    return get
