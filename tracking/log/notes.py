"""What a reader of a recording should know: what in it cannot be used, or has to be assumed."""

from __future__ import annotations

import numpy as np

from tracking.arrays import Bool
from tracking.estimate import Status, TeamEstimate
from tracking.filters.joint.params import JointStartParams
from tracking.log.folder import Log
from tracking.measurements import Kind


def notes_on(log: Log) -> list[str]:
    """A line for each thing that is amiss with sensors, none if all is well."""
    block, constellation, notes = log.block, log.constellation, list[str]()
    kind, node = block.kind[0], block.i[0]
    ids = np.array(constellation.ids)
    with_imu = np.unique(node[kind == Kind.IMU])
    if not np.isin(kind, (Kind.IMU, Kind.STATE)).any():
        notes.append(
            "no IMU samples and no orientations: ranges alone tell neither the rotation nor the "
            "mirror image of the group, so pairs stay ambiguous; rmse_mirror is what can be judged"
        )
    if constellation.heading == "initial":
        unknown = [n for n in with_imu if constellation.nodes[n].initial_heading is None]
        if unknown:
            notes.append(
                f"{_names(ids[unknown])}: no initial_heading_rad in meta.toml, taken for 0 rad; "
                "where they began otherwise, positions are wrong and the tracker does not know"
            )
    else:
        deaf = np.setdiff1d(with_imu, np.unique(node[kind == Kind.MAG]))
        if len(deaf):
            notes.append(f"{_names(ids[deaf])}: no magnetometer readings, so the IMU is not used")
    return notes


def notes_on_estimate(log: Log, estimate: TeamEstimate) -> list[str]:
    """A line for each node that was never placed, and what it lacks.

    Args:
        log: The recording.
        estimate: Its estimates, arrays over (time, pair).
    """
    constellation, block = log.constellation, log.block
    placed = np.asarray(estimate.status >= Status.AMBIGUOUS)
    i, j = constellation.pairs.T
    ever: Bool = np.asarray(placed.any(axis=0))
    is_range = np.isin(block.kind[0], (Kind.RANGE, Kind.SURVEY)) & block.valid[0]
    a, b = block.i[0, is_range], block.j[0, is_range]
    found = [n for n in range(constellation.n_nodes) if ever[(i == n) | (j == n)].any()]
    needed = min(constellation.dimensions + 1, len(found))
    notes, least = [], round(JointStartParams().min_ranges)
    for n in range(constellation.n_nodes):
        if n in found:
            continue
        partners = np.concatenate([b[a == n], a[b == n]])
        others, counts = np.unique(partners, return_counts=True)
        enough = int((counts >= least).sum())
        lacks = (
            f"a node joins by {least} ranges or more with each of {needed} placed nodes"
            if found
            else f"a group starts by {least} ranges or more of every pair of three nodes"
        )
        notes.append(
            f"node {constellation.ids[n]} was never placed: {len(partners)} ranges with "
            f"{len(others)} nodes, {least} or more with {enough}; {lacks}"
        )
    return notes


def _names(ids: np.ndarray) -> str:
    return f"node{'s' if len(ids) > 1 else ''} {', '.join(str(i) for i in ids)}"
