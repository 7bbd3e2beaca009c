"""Use of a recording: unused sensors, nodes that are never placed, rejected ranges."""

from __future__ import annotations

import numpy as np

from tracking.arrays import Bool
from tracking.estimate import Status, TeamEstimate
from tracking.filters.joint.params import JointStartParams
from tracking.findings.ambiguity import find_ambiguous
from tracking.findings.finding import Finding, names
from tracking.log.folder import Log
from tracking.measurements import Kind

LONGEST_SILENCE = 5.0
"""[s] Longest time between the last samples and the last ranges of a node."""
MOST_REFUSED = 0.2
"""[-] Largest share of rejected ranges; tracked recordings have up to 0.02, a lost one 0.5."""


def find_unused(log: Log) -> list[Finding]:
    """Find sensors that are missing or cannot be used, and keys that are not read."""
    block, constellation, found = log.block, log.constellation, list[Finding]()
    kind, node = block.kind[0], block.i[0]
    with_imu = np.unique(node[kind == Kind.IMU])
    if log.unused_keys:
        text = f"meta.toml: {', '.join(log.unused_keys)} not read, expected a key of the log format"
        found.append(Finding("unused-keys", (), text))
    if not np.isin(kind, (Kind.IMU, Kind.STATE)).any():
        text = (
            "no IMU samples and no orientations: ranges alone determine neither the rotation nor "
            "the reflection of the group: pairs stay ambiguous; rmse_mirror is what can be judged"
        )
        found.append(Finding("no-imu", (), text))
    else:
        found += find_without_imu(log)
    if constellation.heading == "initial":
        unknown = [n for n in with_imu if constellation.nodes[n].initial_heading is None]
        ids = tuple(constellation.ids[n] for n in unknown)
        if ids:
            text = (
                f"{names(ids)}: no initial_heading_rad in meta.toml, taken for 0 rad; where they "
                "began otherwise, positions are wrong and the tracker does not know"
            )
            found.append(Finding("no-heading", ids, text))
    else:
        deaf = np.setdiff1d(with_imu, np.unique(node[kind == Kind.MAG]))
        ids = tuple(constellation.ids[n] for n in deaf)
        if ids:
            text = f"{names(ids)}: no magnetometer readings, so the IMU is not used"
            found.append(Finding("no-magnetometer", ids, text))
    return found


def find_without_imu(log: Log) -> list[Finding]:
    """Find moving nodes without samples, or whose samples end long before their ranges."""
    block, constellation, found = log.block, log.constellation, list[Finding]()
    t, valid = block.t[0], block.valid[0]
    sampled = valid & np.isin(block.kind[0], (Kind.IMU, Kind.STATE))
    ranged = valid & (block.kind[0] == Kind.RANGE)
    for n in np.flatnonzero(~constellation.is_static):
        samples, node = t[sampled & (block.i[0] == n)], constellation.ids[n]
        ranges = t[ranged & ((block.i[0] == n) | (block.j[0] == n))]
        if not len(ranges) or (len(samples) and samples[-1] > ranges[-1] - LONGEST_SILENCE):
            continue
        what = f"its IMU samples end at {samples[-1]:.1f} s" if len(samples) else "no IMU samples"
        text = (
            f"node {node}: {what}, its ranges at {ranges[-1]:.1f} s: without them its side of the "
            f"others stays open, unless more than {constellation.dimensions} others have an IMU or "
            "rest"
        )
        found.append(Finding("no-imu", (node,), text))
    return found


def find_in_estimates(log: Log, estimate: TeamEstimate, n_refused: int) -> list[Finding]:
    """Find what estimates of a recording lack, and why.

    Args:
        log: The recording.
        estimate: Its estimates, arrays over (time, pair).
        n_refused: Ranges that the filter refused as outliers.
    """
    found = [*find_unplaced(log, estimate), *find_ambiguous(log, estimate)]
    return [*found, *find_refused(log, n_refused)]


def find_unplaced(log: Log, estimate: TeamEstimate) -> list[Finding]:
    """Find nodes that were never placed, and the ranges that they lack.

    Args:
        log: A recording.
        estimate: Estimates of the recording, arrays over (time, pair).
    """
    constellation, block = log.constellation, log.block
    placed = np.asarray(estimate.status >= Status.AMBIGUOUS)
    i, j = constellation.pairs.T
    ever: Bool = np.asarray(placed.any(axis=0))
    is_range = np.isin(block.kind[0], (Kind.RANGE, Kind.SURVEY)) & block.valid[0]
    a, b = block.i[0, is_range], block.j[0, is_range]
    present = [n for n in range(constellation.n_nodes) if ever[(i == n) | (j == n)].any()]
    needed = min(constellation.dimensions + 1, len(present))
    found, least = list[Finding](), round(JointStartParams().min_ranges)
    for n in range(constellation.n_nodes):
        if n in present:
            continue
        partners = np.concatenate([b[a == n], a[b == n]])
        others, counts = np.unique(partners, return_counts=True)
        enough = int((counts >= least).sum())
        lacks = (
            f"a node joins by {least} ranges or more with each of {needed} placed nodes"
            if present
            else f"a group starts by {least} ranges or more of every pair of three nodes"
        )
        text = (
            f"node {constellation.ids[n]} was never placed: {len(partners)} ranges with "
            f"{len(others)} nodes, {least} or more with {enough}; {lacks}"
        )
        found.append(Finding("never-placed", (constellation.ids[n],), text))
    return found


def find_refused(log: Log, n_refused: int) -> list[Finding]:
    """Report a large share of rejected ranges.

    Args:
        log: A recording.
        n_refused: Number of ranges that the filter rejected as outliers.
    """
    share = n_refused / max(log.n_ranges, 1)
    if share <= MOST_REFUSED:
        return []
    text = (
        f"{share:.0%} of the ranges were refused as outliers: their errors are larger than the "
        "filter assumes (decimetres, longer behind obstacles), or the group was lost"
    )
    return [Finding("ranges-refused", (), text)]
