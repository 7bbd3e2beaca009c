"""A folder of CSV files, compressed or not."""

from __future__ import annotations

import csv
import gzip
import io
import zlib
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
            try:
                data = path.read_bytes()
                text = (gzip.decompress(data) if path.suffix == ".gz" else data).decode("utf-8-sig")
            except (OSError, EOFError, zlib.error, UnicodeDecodeError) as error:
                raise UsageError(f"{path.name}: cannot be read ({error})") from error
            for k, row in enumerate(csv.DictReader(io.StringIO(text))):
                where = f"{path.name} row {k + 2}"
                if self._time and self._time not in row:
                    raise UsageError(f"{path.name}: no column {self._time!r}, found {[*row]}")
                if None in row.values() or None in row:
                    raise UsageError(f"{where}: expected as many fields as the first row has")
                try:
                    t = float(row[self._time] or "nan") if self._time else float("nan")
                except ValueError:
                    found = row[self._time]
                    raise UsageError(
                        f"{where}, {self._time}: expected a number, found {found!r}"
                    ) from None
                yield Record(name, k, t, row.__getitem__)

    def close(self) -> None:
        """Do nothing: no file stays open."""
