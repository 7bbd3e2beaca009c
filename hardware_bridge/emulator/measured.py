"""Rows of measurement blocks, sorted by the node that measured them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tracking.measurements import Kind, MeasurementBlock

SAID_BY_NODES = (Kind.MAG, Kind.IMU, Kind.STATE, Kind.RANGE)
"""Kinds of events that devices send; all others are not measurements."""


class Measured(NamedTuple):
    """One event of a node."""

    t: float
    """[s] World time."""
    kind: Kind
    node: int
    """Index of the node that it is about; of a range, of its near end."""
    other: int
    """Index of the other node of a range, else that of the node."""
    values: tuple[float, ...]
    """Columns as defined by `Kind`."""
    has_power: bool


def by_node(block: MeasurementBlock, n_nodes: int) -> list[list[Measured]]:
    """Return each node's measurements in order of time; ranges belong to the resolving node.

    Args:
        block: Measurements of one environment, in any order.
        n_nodes: Number of nodes.
    """
    rows: list[list[Measured]] = [[] for _ in range(n_nodes)]
    here = np.flatnonzero(block.valid[0])
    # Only valid columns are sorted, since most of them are padding.
    here = here[np.lexsort((block.j[0, here], block.kind[0, here], block.t[0, here]))]
    columns = (block.t, block.kind, block.i, block.j, block.values, block.has_power)
    for t, kind, i, j, values, power in zip(*(c[0, here].tolist() for c in columns), strict=True):
        if kind in SAID_BY_NODES:
            rows[i].append(Measured(t, Kind(kind), i, j, tuple(values), power))
    return rows


def by_receiver(measured: list[list[Measured]], known: MeasurementBlock) -> list[list[Measured]]:
    """Return what each node knows: its own samples, and what its radio received.

    Args:
        measured: Measurements by the node that measured them, see `by_node`.
        known: Events of every node in the order in which it knows them, (node, event). Of them the
            states of others and the ranges are used.
    """
    rows = [[row for row in own if row.kind is not Kind.RANGE] for own in measured]
    for k in range(known.n_envs):
        is_heard = known.valid[k] & (
            (known.kind[k] == Kind.RANGE) | ((known.kind[k] == Kind.STATE) & (known.i[k] != k))
        )
        for m in np.flatnonzero(is_heard).tolist():
            kind, i, j = Kind(int(known.kind[k, m])), int(known.i[k, m]), int(known.j[k, m])
            values = tuple(known.values[k, m].tolist())
            rows[k].append(
                Measured(float(known.t[k, m]), kind, i, j, values, bool(known.has_power[k, m]))
            )
    return rows
