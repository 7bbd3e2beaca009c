"""Estimates as trajectories in the text format of the TUM RGB-D benchmark.

Lines are ``timestamp tx ty tz qx qy qz qw``: position of a node relative to the reference node in
the axes of the world, and orientation of its body in the world (Sturm et al., A benchmark for the
evaluation of RGB-D SLAM systems, IROS 2012).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hardware_bridge.errors import BridgeError
from hardware_bridge.exports.stamps import stamps_ns
from hardware_bridge.exports.whole import whole_folder
from tracking.constellation import Constellation
from tracking.estimate import TeamEstimate

_FIRST = "# timestamp tx ty tz qx qy qz qw\n"


def export_tum(
    folder: Path | str,
    estimate: TeamEstimate,
    *,
    reference: int | None = None,
    offset_ns: int = 0,
) -> Path:
    """Write ``node_ID.txt`` for every node but the reference that has an estimate.

    Args:
        folder: New or empty folder.
        estimate: Estimates, arrays over (time, ...).
        reference: Id of the node that stays at the origin; default: the first.
        offset_ns: Offset added to every time [ns], `Header.wall_ns` for UTC.

    Raises:
        BridgeError: The folder is not empty, the node is unknown, or there is no estimate.
    """
    constellation = estimate.constellation
    reference = constellation.ids[0] if reference is None else reference
    check_reference(constellation, reference)
    texts = {
        node: tum_text(estimate, node, reference=reference, offset_ns=offset_ns)
        for node in constellation.ids
        if node != reference
    }
    texts = {node: text for node, text in texts.items() if text != _FIRST}
    if not texts:
        raise BridgeError(f"{folder}: no pair with node {reference} ever had an estimate")
    with whole_folder(folder) as scratch:
        for node, text in texts.items():
            (scratch / f"node_{node}.txt").write_text(text, encoding="ascii")
    return Path(folder)


def tum_text(estimate: TeamEstimate, node: int, *, reference: int, offset_ns: int = 0) -> str:
    """Return the trajectory of one node relative to another, both by id.

    The format has no field for a status, so only estimates with status OK are written. A node
    without a measured orientation is aligned with the axes of the world.
    """
    constellation = estimate.constellation
    i, j = (constellation.index_of[name] for name in (reference, node))
    stamps = stamps_ns(estimate.t, offset_ns)
    pos, _ = estimate.between(i, j)
    q_wxyz = np.where(
        estimate.has_orientation[:, j, None], estimate.q_wb[:, j], [1.0, 0.0, 0.0, 0.0]
    )
    lines = [_FIRST]
    for k in np.nonzero(estimate.ok[:, constellation.pair_index[i, j]])[0]:
        second, part = divmod(stamps[k], 1_000_000_000)
        w, x, y, z = q_wxyz[k]
        numbers = " ".join([*(f"{v:.6f}" for v in pos[k]), *(f"{v:.9f}" for v in (x, y, z, w))])
        lines.append(f"{second}.{part:09d} {numbers}\n")
    return "".join(lines)


def check_reference(constellation: Constellation, reference: int) -> None:
    """Check that the reference is a node.

    Raises:
        BridgeError: There is no such node.
    """
    if reference not in constellation.ids:
        raise BridgeError(
            f"reference: no node {reference}, expected one of "
            f"{', '.join(map(str, constellation.ids))}"
        )
