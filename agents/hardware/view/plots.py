"""Time series of pairs and nodes."""

from __future__ import annotations

from types import ModuleType
from typing import Any

import numpy as np

from agents.evaluation.estimates_csv import pair_name
from agents.hardware.live.snapshot import Snapshot
from tracking.arrays import F64, Bool
from tracking.estimate import TeamEstimate

OF_PAIRS = ("distance", "sigma", "nlos")
COLOURS = (
    (31, 119, 180), (255, 127, 14), (44, 160, 44), (214, 39, 40), (148, 103, 189), (140, 86, 75),
    (227, 119, 194), (127, 127, 127), (188, 189, 34), (23, 190, 207),
)  # fmt: skip
"""RGB colours of curves, the same in all plots, used cyclically."""


def style_plots(rr: ModuleType, stream: Any, snapshot: Snapshot) -> None:
    """Set names and colours of the curves."""
    for k, pair in enumerate(snapshot.pairs):
        name, colour = f"{pair.node_i}-{pair.node_j}", COLOURS[k % len(COLOURS)]
        for kind in (*OF_PAIRS, "error"):
            style = rr.SeriesLines(names=name, colors=colour)
            stream.log(f"{kind}/{name}", style, static=True)
    for k, node in enumerate(snapshot.nodes):
        style = rr.SeriesLines(names=f"node {node.node}", colors=COLOURS[k % len(COLOURS)])
        stream.log(f"ranges/{node.node}", style, static=True)


def log_numbers(rr: ModuleType, stream: Any, snapshot: Snapshot) -> None:
    """Log a snapshot at the current time of the stream; NaN for pairs without an estimate."""
    for pair in snapshot.pairs:
        name = f"{pair.node_i}-{pair.node_j}"
        for kind, value in zip(OF_PAIRS, (pair.distance, pair.std, pair.nlos_prob), strict=True):
            number = np.nan if value is None else value
            stream.log(f"{kind}/{name}", rr.Scalars(number))
    for node in snapshot.nodes:
        stream.log(f"ranges/{node.node}", rr.Scalars(node.range_hz))


def log_errors(
    rr: ModuleType, stream: Any, timeline: str, estimate: TeamEstimate, errors: F64, known: Bool
) -> None:
    """Log the errors of a whole run; arguments as for `Viewer.show_errors`."""
    group = estimate.constellation
    for p in range(group.n_pairs):
        rows = known[:, p] & estimate.ok[:, p]
        if rows.any():
            stream.send_columns(
                f"error/{pair_name(group, p)}",
                indexes=[rr.TimeColumn(timeline, duration=estimate.t[rows])],
                columns=rr.Scalars.columns(scalars=errors[rows, p]),
            )
