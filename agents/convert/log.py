"""Conversion of rows of measurements to a log."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from agents.convert.mapping import Plan
from tracking.arrays import F64, I64
from tracking.constellation import Constellation
from tracking.errors import LogError
from tracking.log import Log
from tracking.log.inertial import check_inertial, in_body_axes, with_rates
from tracking.log.truth import Truth
from tracking.measurements import Kind, MeasurementBlock
from tracking.sanity.measurements import FARTHEST

MOST_WRONG = 0.5
"""[-] Largest share of impossible ranges; the reader leaves them out."""
LONG_GAP = 10.0
"""[-] Longest gap within one line fit, in sample periods of an IMU."""
OF_ONE_NODE = {"imu": Kind.IMU, "mag": Kind.MAG, "state": Kind.STATE}
"""Measurement kind of tables with one node per row."""


def build_log(plan: Plan, tables: dict[str, F64], restamp: bool) -> Log:
    """Build the log of a recording.

    Args:
        plan: The mapping.
        tables: Non-empty tables of `imu`, `mag`, `state`, `ranges` and `truth`, as `read_rows`
            returns them; `ranges` is required.
        restamp: Replace the times of IMU samples by those of a steady rate.

    Returns:
        The log with times from 0, without nodes that are neither measured nor surveyed.

    Raises:
        ConfigError: Fewer than two nodes are left, or a range does not name the antenna of a node
            that has several.
    """
    tables = {name: rows[np.lexsort((rows[:, 1], rows[:, 0]))] for name, rows in tables.items()}
    start = min(float(rows[0, 0]) for rows in tables.values())
    for rows in tables.values():
        rows[:, 0] -= start  # absolute times would lose precision
    if restamp and "imu" in tables:
        tables["imu"] = steady(tables["imu"])
    places = plan.places
    group = _seen(plan.meta.constellation, tables, set(places))
    blocks = [_surveys(group, places, float(tables["ranges"][0, 0]))]
    blocks.append(_ranges(group, tables["ranges"]))
    for name, kind in OF_ONE_NODE.items():
        if name in tables:
            rows = tables[name]
            nodes = _indices(group, rows[:, 1])
            blocks.append(MeasurementBlock.of_kind(kind, rows[:, 0], nodes, rows[:, 2:]))
    group, block = in_body_axes(group, MeasurementBlock.concatenate(blocks))
    return Log(
        name=plan.meta.name,
        source=plan.meta.source,
        licence=plan.meta.licence,
        range_noise=plan.meta.range_noise,
        constellation=group,
        block=block.take(block.order()[0]),
        truth=_truth(group, places, tables.get("truth", np.zeros((0, 9)))),
    )


def check_log(log: Log) -> None:
    """Check the units and clocks of a converted log, as far as its reader does.

    Raises:
        LogError: Most ranges are impossible, or inertial samples are on another clock.
    """
    metres = log.block.values[0, log.block.kind[0] == Kind.RANGE, 0]
    wrong = np.mean(~((metres > 0.0) & (metres <= FARTHEST)))
    if wrong > MOST_WRONG:
        raise LogError(
            f"[[ranges]]: {wrong:.0%} are not within 0 to {FARTHEST:g} m, median "
            f"{np.median(metres):g}; expected metres, see scale"
        )
    check_inertial(log.block, log.constellation)
    with_rates(log.constellation, log.block)


def _seen(group: Constellation, tables: dict[str, F64], surveyed: set[int]) -> Constellation:
    """Return the constellation of the nodes that are measured or surveyed."""
    ids = surveyed | {int(node) for rows in tables.values() for node in np.unique(rows[:, 1])}
    ids |= {int(node) for node in np.unique(tables["ranges"][:, 2])}
    return replace(
        group,
        nodes=tuple(node for node in group.nodes if node.id in ids),
        antennas=tuple(antenna for antenna in group.antennas if antenna.node in ids),
    )


def _indices(group: Constellation, ids: F64) -> I64:
    found, inverse = np.unique(ids.astype(np.int64), return_inverse=True)
    return np.array([group.index_of[int(k)] for k in found], dtype=np.int64)[inverse]


def _antennas(group: Constellation, nodes: F64, ids: F64) -> I64:
    """Return array indices of antennas."""
    named = np.stack((nodes, ids), axis=1).astype(np.int64)
    found, inverse = np.unique(named, axis=0, return_inverse=True)
    known = [group.antenna_index(int(n), int(a) if a >= 0 else None) for n, a in found]
    return np.array(known, dtype=np.int64)[inverse.reshape(-1)]


def _ranges(group: Constellation, rows: F64) -> MeasurementBlock:
    has_power = np.asarray(np.isfinite(rows[:, 4:6]).all(axis=1))
    return MeasurementBlock.of_kind(
        Kind.RANGE,
        rows[:, 0],
        _indices(group, rows[:, 1]),
        np.where(np.isfinite(rows[:, 3:6]), rows[:, 3:6], 0.0),
        j=_indices(group, rows[:, 2]),
        antennas=(
            _antennas(group, rows[:, 1], rows[:, 6]),
            _antennas(group, rows[:, 2], rows[:, 7]),
        ),
        has_power=has_power,
    )


def _surveys(
    group: Constellation, places: dict[int, tuple[float, float, float]], t: float
) -> MeasurementBlock:
    """Return surveyed distances between nodes with known positions, at a time [s]."""
    known = [node for node in group.ids if node in places]
    pairs = [(a, b) for k, a in enumerate(known) for b in known[k + 1 :]]
    ends = np.array(pairs, dtype=np.float64).reshape(-1, 2)
    at = [np.array([places[int(k)] for k in end]).reshape(-1, 3) for end in ends.T]
    unnamed = np.full(len(pairs), -1.0)
    return MeasurementBlock.of_kind(
        Kind.SURVEY,
        np.full(len(pairs), t),
        _indices(group, ends[:, 0]),
        np.linalg.norm(at[0] - at[1], axis=1)[:, None],
        j=_indices(group, ends[:, 1]),
        antennas=(_antennas(group, ends[:, 0], unnamed), _antennas(group, ends[:, 1], unnamed)),
    )


def _truth(group: Constellation, places: dict[int, tuple[float, float, float]], rows: F64) -> Truth:
    fixed = [(0.0, node, *place, 1.0, 0.0, 0.0, 0.0) for node, place in places.items()]
    every = np.concatenate([np.array(fixed).reshape(-1, 9), rows])
    every = every[np.lexsort((every[:, 1], every[:, 0]))]
    known = np.isfinite(every[:, 5:9]).all(axis=1)
    return Truth(
        every[:, 0],
        _indices(group, every[:, 1]),
        every[:, 2:5],
        np.where(known[:, None], every[:, 5:9], 0.0),
        known,
        np.ones(len(every), dtype=bool),
    )


def steady(rows: F64) -> F64:
    """Return samples with times of a steady rate of each node, without repeats and jitter.

    Args:
        rows: Samples, (row, column): t [s], node, values.
    """
    out = []
    for node in np.unique(rows[:, 1]):
        own = rows[rows[:, 1] == node].copy()
        steps = np.diff(own[:, 0])
        period = float(np.median(steps[steps > 0.0])) if (steps > 0.0).any() else 0.0
        cuts = np.nonzero(steps > LONG_GAP * period)[0] + 1
        for part in np.split(own, cuts):
            if len(part) > 2 and period > 0.0:
                # A line fit of times over sample indices keeps the number of samples.
                k = np.arange(len(part), dtype=np.float64)
                slope, first = np.polyfit(k, part[:, 0], 1)
                part[:, 0] = first + slope * k
            out.append(part)
    every = np.concatenate(out)
    return every[np.lexsort((every[:, 1], every[:, 0]))]
