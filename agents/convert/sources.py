"""Interface of a recording as streams of records, independent of its file format."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple, Protocol

Get = Callable[[str], Any]


class Record(NamedTuple):
    """One message or row."""

    stream: str
    k: int
    """[-] Index in the stream, from 0."""
    t: float
    """[s] Time; NaN if the recording has no time."""
    get: Get
    """Function that returns a field by its name; raises KeyError for a missing field."""


class Source(Protocol):
    """A recording."""

    def names(self) -> list[str]:
        """Return the names of the streams."""

    def records(self, names: list[str]) -> Iterator[Record]:
        """Yield the records of some streams."""

    def close(self) -> None:
        """Close the files of the recording."""


def pattern(stream: str) -> re.Pattern[str]:
    """Return a regular expression for names of a stream; parts in braces are named groups."""
    parts = re.split(r"\{(\w+)\}", stream)
    text = "".join(
        re.escape(part) if k % 2 == 0 else f"(?P<{part}>[^/]+?)" for k, part in enumerate(parts)
    )
    return re.compile(f"{text}$")
