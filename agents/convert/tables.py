"""A folder of CSV files, compressed or not."""

from __future__ import annotations

import csv
import gzip
import io
from collections.abc import Iterator
from pathlib import Path

from agents.convert.sources import Record
from agents.errors import UsageError


class Tables:
    """Source with files as streams, named by their path in the folder without suffix."""

    def __init__(self, folder: Path, time: str) -> None:
        """Find the files.

        Args:
            folder: Folder of CSV files.
            time: Column with the time [s]; empty if the mapping gives rates.

        Raises:
            UsageError: There are no CSV files.
        """
        self._files = {
            path.relative_to(folder).as_posix().removesuffix(".gz").removesuffix(".csv"): path
            for path in sorted(folder.rglob("*.csv*"))
        }
        self._time = time
        if not self._files:
            raise UsageError(f"{folder}: expected a folder with CSV files")

    def names(self) -> list[str]:
        """Return the names of the files."""
        return list(self._files)

    def records(self, names: list[str]) -> Iterator[Record]:
        """Yield rows, file after file."""
        for name in names:
            path = self._files[name]
            data = gzip.decompress(path.read_bytes()) if path.suffix == ".gz" else path.read_bytes()
            for k, row in enumerate(csv.DictReader(io.StringIO(data.decode("utf-8-sig")))):
                if self._time and self._time not in row:
                    raise UsageError(f"{path.name}: no column {self._time!r}, found {[*row]}")
                t = float(row[self._time] or "nan") if self._time else float("nan")
                yield Record(name, k, t, row.__getitem__)

    def close(self) -> None:
        """Do nothing: no file stays open."""
