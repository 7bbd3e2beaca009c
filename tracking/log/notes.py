"""What a reader of a recording should know: what in it cannot be used, or has to be assumed."""

from __future__ import annotations

import numpy as np

from tracking.log.folder import Log
from tracking.measurements import Kind


def notes_on(log: Log) -> list[str]:
    """A line for each thing that is amiss with sensors, none if all is well."""
    block, constellation, notes = log.block, log.constellation, []
    kind, node = block.kind[0], block.i[0]
    ids = np.array(constellation.ids)
    with_imu = np.unique(node[kind == Kind.IMU])
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


def _names(ids: np.ndarray) -> str:
    return f"node{'s' if len(ids) > 1 else ''} {', '.join(str(i) for i in ids)}"
