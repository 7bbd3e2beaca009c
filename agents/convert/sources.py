"""A recording as streams of records, whatever files it is in."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple, Protocol

Get = Callable[[str], Any]


class Record(NamedTuple):
    """One message or row."""

    stream: str
    k: int
    """[-] Its number in the stream, from 0."""
    t: float
    """[s] NaN where the recording has no time."""
    get: Get
    """Its fields by name; raises KeyError for a field that it lacks."""


class Source(Protocol):
    """A recording."""

    def names(self) -> list[str]:
        """Return the names of its streams."""

    def records(self, names: list[str]) -> Iterator[Record]:
        """Yield the records of some streams."""

    def close(self) -> None:
        """Close its files."""


def pattern(stream: str) -> re.Pattern[str]:
    """Return the expression that names of a stream match; parts in braces are named groups."""
    parts = re.split(r"\{(\w+)\}", stream)
    text = "".join(
        re.escape(part) if k % 2 == 0 else f"(?P<{part}>[^/]+?)" for k, part in enumerate(parts)
    )
    return re.compile(f"{text}$")
