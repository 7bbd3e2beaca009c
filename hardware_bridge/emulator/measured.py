"""Rows of measurement blocks, sorted out by the node that measured them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tracking.measurements import Kind, MeasurementBlock

SAID_BY_NODES = (Kind.MAG, Kind.IMU, Kind.STATE, Kind.RANGE)
"""What devices send; all other events are not measured."""


class Measured(NamedTuple):
    """One event of a node."""

    t: float
    """[s] Of the world."""
    kind: Kind
    other: int
    """Index of the other node of a range, else that of the node."""
    values: tuple[float, ...]
    """As `Kind` says."""
    has_power: bool


def by_node(block: MeasurementBlock, n_nodes: int) -> list[list[Measured]]:
    """What each node measured, in order of time. Ranges belong to the node that resolved them.

    Args:
        block: Of one environment, in any order.
        n_nodes: How many there are.
    """
    rows: list[list[Measured]] = [[] for _ in range(n_nodes)]
    here = np.flatnonzero(block.valid[0])
    # As sorted, but only what is there: most of the columns are padding.
    here = here[np.lexsort((block.j[0, here], block.kind[0, here], block.t[0, here]))]
    columns = (block.t, block.kind, block.i, block.j, block.values, block.has_power)
    for t, kind, i, j, values, power in zip(*(c[0, here].tolist() for c in columns), strict=True):
        if kind in SAID_BY_NODES:
            rows[i].append(Measured(t, Kind(kind), j, tuple(values), power))
    return rows
