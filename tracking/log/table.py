"""A CSV file as checked columns; errors name file, row and field."""

from __future__ import annotations

import csv
import gzip
import io
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tracking.arrays import F64, I64, Bool
from tracking.errors import LogError

MOST_BYTES = 256 << 20
"""Largest table, unpacked: hours of a large group. Compression has no bound, and rows of text
take some twenty times their bytes in memory."""
MAX_SILENCE = 86400.0
"""[s] Longest step between two rows; a longer one is a broken clock."""


def find_table(folder: Path, stem: str) -> Path | None:
    """Return the file of a table, plain or gzip-compressed; None if there is none.

    Raises:
        LogError: Both exist, and may differ.
    """
    paths = [folder / (stem + suffix) for suffix in (".csv", ".csv.gz")]
    found = [path for path in paths if path.exists() or path.is_symlink()]
    if len(found) > 1:
        raise LogError(f"{folder}: both {found[0].name} and {found[1].name}, expected one of them")
    return found[0] if found else None


@dataclass(frozen=True, slots=True)
class Table:
    """Text columns of one file; row 1 is the header, so data row k is row k + 2."""

    path: Path
    columns: dict[str, list[str]]
    n_rows: int

    @classmethod
    def read(cls, path: Path, required: tuple[str, ...]) -> Table:
        """Read a file and check its header.

        Raises:
            LogError: The file is not text, or has no header, a missing column or a ragged row.
        """
        try:
            open_table = gzip.open if path.suffix == ".gz" else open
            with open_table(path, "rb") as stream:
                raw = stream.read(MOST_BYTES + 1)
            if len(raw) > MOST_BYTES:
                raise LogError(f"{path.name}: expected at most {MOST_BYTES >> 20} MiB of text")
            text = raw.decode("utf-8-sig")
        except (OSError, EOFError, UnicodeDecodeError, zlib.error) as error:
            raise LogError(f"{path.name}: cannot be read ({error})") from error
        try:
            rows = list(csv.reader(io.StringIO(text), strict=True, skipinitialspace=True))
        except csv.Error as error:
            raise LogError(f"{path.name}: not a CSV table ({error})") from error
        while rows and not any(rows[-1]):
            rows.pop()
        if not rows:
            raise LogError(f"{path.name}: empty, expected a header with {', '.join(required)}")
        header = [name.strip() for name in rows[0]]
        twice = [name for name in header if header.count(name) > 1]
        if twice:
            raise LogError(f"{path.name}: duplicate column {twice[0]!r}")
        missing = [name for name in required if name not in header]
        if missing:
            raise LogError(
                f"{path.name}: column {missing[0]!r} is missing, found {', '.join(header)}"
            )
        for k, row in enumerate(rows[1:], start=2):
            if not row:
                raise LogError(f"{path.name} row {k}: empty, expected {len(header)} fields")
            if len(row) != len(header):
                raise LogError(
                    f"{path.name} row {k}: expected {len(header)} fields, found {len(row)}"
                )
        data = list(zip(*rows[1:], strict=True)) if len(rows) > 1 else [()] * len(header)
        columns = {name: list(column) for name, column in zip(header, data, strict=True)}
        return cls(path, columns, len(rows) - 1)

    def __contains__(self, column: str) -> bool:
        return column in self.columns

    def text(self, column: str) -> list[str]:
        """Return a column as text."""
        return self.columns[column]

    def numbers(self, columns: tuple[str, ...]) -> tuple[F64, Bool]:
        """Return columns as numbers, (row, column), and a mask of the fields that are not empty.

        Raises:
            LogError: A field holds text in place of a number.
        """
        values = np.zeros((self.n_rows, len(columns)))
        filled = np.ones((self.n_rows, len(columns)), dtype=bool)
        for k, name in enumerate(columns):
            cells = self.columns[name]
            try:
                values[:, k] = np.array(cells, dtype=np.str_).astype(np.float64)
            except ValueError:
                for r, cell in enumerate(cells):
                    if not cell.strip():
                        filled[r, k] = False
                        continue
                    try:
                        values[r, k] = float(cell)
                    except ValueError:
                        raise LogError(
                            f"{self.path.name} row {r + 2}, {name}: expected a number, "
                            f"found {cell!r}"
                        ) from None
        return values, filled

    def times(self) -> F64:
        """Return the column t_s, which must be finite and never decrease.

        Raises:
            LogError: A time is missing or not finite, decreases, or jumps.
        """
        values, filled = self.numbers(("t_s",))
        t = values[:, 0]
        bad = np.nonzero(~filled[:, 0] | ~np.isfinite(t))[0]
        if len(bad):
            raise LogError(
                f"{self.path.name} row {bad[0] + 2}, t_s: expected seconds, "
                f"found {self.columns['t_s'][bad[0]]!r}"
            )
        back = np.nonzero(np.diff(t) < 0.0)[0]
        if len(back):
            k = int(back[0]) + 1
            raise LogError(
                f"{self.path.name} row {k + 2}, t_s: time goes back from {t[k - 1]:.12g} to "
                f"{t[k]:.12g} s, expected rows in time order"
            )
        jump = np.nonzero(np.diff(t) > MAX_SILENCE)[0]
        if len(jump):
            k = int(jump[0]) + 1
            raise LogError(
                f"{self.path.name} row {k + 2}, t_s: jumps by {t[k] - t[k - 1]:g} s from "
                f"{t[k - 1]:.12g} s, expected seconds on one clock"
            )
        return t

    def nodes(self, column: str, index_of: dict[int, int]) -> I64:
        """Return a column of node ids as indices.

        Raises:
            LogError: An entry is not an integer, or a node missing from meta.toml.
        """
        table: dict[str, int] = {}
        for r, cell in enumerate(self.columns[column]):
            if cell in table:
                continue
            try:
                node_id = int(cell)
            except ValueError:
                raise LogError(
                    f"{self.path.name} row {r + 2}, {column}: expected a node id, found {cell!r}"
                ) from None
            if node_id not in index_of:
                raise LogError(
                    f"{self.path.name} row {r + 2}, {column}: meta.toml names no node {node_id}, "
                    f"it names {', '.join(map(str, index_of))}"
                )
            table[cell] = index_of[node_id]
        return np.array([table[cell] for cell in self.columns[column]], dtype=np.int64)

    def check_share(self, good: Bool, expected: str, columns: tuple[str, ...]) -> None:
        """Reject a file whose rows are mostly bad; the caller leaves single bad rows out.

        Args:
            good: True for usable rows.
            expected: Contents of a usable row, for the message.
            columns: Fields concerned, for the message.

        Raises:
            LogError: More than half of the rows are bad.
        """
        n_bad = int(np.sum(~good))
        if 2 * n_bad > len(good):
            r = int(np.nonzero(~good)[0][0])
            found = ", ".join(self.columns[name][r] for name in columns)
            raise LogError(
                f"{self.path.name} row {r + 2}, {', '.join(columns)}: expected {expected}, "
                f"found {found!r}; {n_bad} of {len(good)} rows are like this"
            )
