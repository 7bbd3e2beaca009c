"""Measurements that arrived and were not passed to the tracker yet."""

from __future__ import annotations

import numpy as np

from tracking.measurements import N_VALUES, Kind, MeasurementBlock

Row = tuple[float, int, int, int, int, int, tuple[float, ...], bool]


class Events:
    """List of measurements that are moved into a block in place."""

    def __init__(self) -> None:
        self._rows: list[Row] = []

    def __len__(self) -> int:
        return len(self._rows)

    def add(self, t: float, kind: Kind, node: int, values: tuple[float, ...]) -> None:
        """Add a measurement of one node; arguments as the columns of `MeasurementBlock`."""
        self._rows.append((t, kind, node, node, 0, 0, values, False))

    def add_range(
        self, t: float, ends: tuple[int, int], antennas: tuple[int, int], values: tuple[float, ...]
    ) -> None:
        """Add a range: distance alone, or with received and first-path power."""
        self._rows.append((t, Kind.RANGE, *ends, *antennas, values, len(values) == 3))

    def move_into(self, block: MeasurementBlock) -> None:
        """Move all measurements into the first environment of a block of sufficient capacity."""
        n = len(self._rows)
        block.valid[0] = False
        if n:
            numbers = np.zeros((n, N_VALUES))
            for k, row in enumerate(self._rows):
                numbers[k, : len(row[6])] = row[6]
            columns = list(zip(*self._rows, strict=True))
            fields = (block.t, block.kind, block.i, block.j, block.antenna_i, block.antenna_j)
            for field, column in zip(fields, columns, strict=False):
                field[0, :n] = column
            block.values[0, :n] = numbers
            block.has_power[0, :n] = columns[7]
            block.valid[0, :n] = True
        self._rows = []
