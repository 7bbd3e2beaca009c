"""Why an image is open: the layout, or the motion of the nodes with an IMU, is degenerate."""

from __future__ import annotations

import numpy as np

from tracking.arrays import F64, I64, Bool
from tracking.estimate import Status, TeamEstimate
from tracking.findings.finding import Finding, names
from tracking.log.folder import Log
from tracking.measurements import Kind

MOST_AMBIGUOUS = 0.5
"""[-] Share of the time that may be ambiguous without a reason being looked for."""
FLAT = 0.1
"""[-] Extent across over that along, below which nodes are near a line or a plane."""
FLAT_PATH = 0.2
"""[-] The same for a path; paths that distinguish both images have 0.4."""
LARGEST_STEP = 0.3
"""[m] Largest step of a path; a larger one is a change between images of the layout."""


def find_ambiguous(log: Log, estimate: TeamEstimate) -> list[Finding]:
    """Find why a layout stays ambiguous, and motion from which no image is certain.

    Args:
        log: The recording.
        estimate: Its estimates, arrays over (time, pair).
    """
    constellation = log.constellation
    placed = np.asarray((estimate.status >= Status.AMBIGUOUS).all(axis=1))
    open_sides: Bool = placed & (estimate.status == Status.AMBIGUOUS).any(axis=1)
    if constellation.n_nodes <= constellation.dimensions or not placed.any():
        return []
    if open_sides.mean() <= MOST_AMBIGUOUS:
        return _flat_motion(log, estimate, placed)
    return (
        _flat_layout(estimate, open_sides)
        or _flat_motion(log, estimate, placed)
        or _undecided(log, open_sides)
    )


def _flat_layout(estimate: TeamEstimate, open_sides: Bool) -> list[Finding]:
    """Report nodes that are near a line, or in space near a plane."""
    constellation = estimate.constellation
    d, n = constellation.dimensions, constellation.n_nodes
    to_first = np.flatnonzero(constellation.pairs[:, 0] == 0)
    pos = estimate.pos_ij_w[open_sides][:, to_first, :d]
    pos = np.concatenate([np.zeros_like(pos[:, :1]), pos], axis=1)
    extent = np.linalg.svd(pos - pos.mean(axis=1, keepdims=True), compute_uv=False) / np.sqrt(n)
    least, most = float(np.median(extent[:, -1])), float(np.median(extent[:, 0]))
    if least > FLAT * most:
        return []
    text = (
        f"for {open_sides.mean():.0%} of the time the nodes stay near {_shape(d)} ({least:.2f} m "
        f"across, {most:.2f} m along, standard deviations): it is its own mirror image, so pairs "
        "are ambiguous until the group leaves it"
    )
    return [Finding("degenerate-layout", (), text)]


def _flat_motion(log: Log, estimate: TeamEstimate, placed: Bool) -> list[Finding]:
    """Report a path near a line or plane, if only one node has an IMU and others are static."""
    constellation, d = log.constellation, log.constellation.dimensions
    moving, static = _with_imu(log), np.flatnonzero(constellation.is_static)
    if len(moving) != 1 or not len(static):
        return []
    path = estimate.between(int(static[0]), int(moving[0]))[0][placed, :d]
    least, most = _extent(path)
    if least > FLAT_PATH * most:
        return []
    ids = tuple(constellation.ids[n] for n in moving)
    text = (
        f"the path of {names(ids)} stays near {_shape(d)} ({least:.2f} m across, {most:.2f} m "
        "along, standard deviations), so the static nodes and their mirror image across it fit "
        "almost equally well: what is ok may be the mirror image"
    )
    return [Finding("degenerate-motion", ids, text)]


def _undecided(log: Log, open_sides: Bool) -> list[Finding]:
    """Report motion that does not tell a layout from its rotations and its mirror image."""
    ids = tuple(log.constellation.ids[n] for n in _with_imu(log))
    if not ids:
        return []  # `no-imu` says it
    text = (
        f"for {open_sides.mean():.0%} of the time pairs are ambiguous: the motion of {names(ids)} "
        "did not tell the layout from its rotations and mirror image"
    )
    return [Finding("undecided-layout", ids, text)]


def _with_imu(log: Log) -> I64:
    """Return the nodes with inertial samples."""
    inertial = np.isin(log.block.kind[0], (Kind.IMU, Kind.STATE)) & log.block.valid[0]
    return np.unique(log.block.i[0, inertial])


def _extent(path: F64) -> tuple[float, float]:
    """Return the least and the largest standard deviation of the longest path without a jump."""
    jumps = np.flatnonzero(np.linalg.norm(np.diff(path, axis=0), axis=1) > LARGEST_STEP) + 1
    longest = max(np.split(path, jumps), key=len)
    extent = np.linalg.svd(longest - longest.mean(axis=0), compute_uv=False)
    extent /= np.sqrt(len(longest))
    return float(extent[-1]), float(extent[0])


def _shape(dimensions: int) -> str:
    return "a line" if dimensions == 2 else "a plane"
