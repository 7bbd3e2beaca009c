"""Check of IMU samples at rest: gravity upwards and in m/s2, and no rotation.

Cars are at rest until they are armed. A car whose IMU is upside down or measures in g would drive
with wrong estimates that are reported as valid.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tracking.constellation import NodeConfig
from tracking.findings import KINDS
from tracking.findings.at_rest import find_in_samples

SECONDS = 2.0
"""[s] Duration of the initial samples of every IMU that are checked, once."""


class AtRest:
    """Check of the first samples of each node."""

    def __init__(self, nodes: Sequence[NodeConfig]) -> None:
        """Create a check without samples; nodes by index."""
        self._nodes = nodes
        self._samples: dict[int, list[tuple[float, ...]]] = {}
        self.wrong: dict[int, str] = {}
        """Reason why the IMU of a node is unusable, by index."""

    def note(self, node: int, values: tuple[float, ...], t_ns: int) -> list[tuple[int, str]]:
        """Add a sample; return times and texts of notices about the node once its check completes.

        Args:
            node: Index of the node.
            values: Angular rate [rad/s] and specific force [m/s2].
            t_ns: Arrival, by the host's clock [ns].
        """
        taken, hz = self._samples.setdefault(node, []), self._nodes[node].imu_hz
        needed = round(SECONDS * hz)
        if len(taken) >= needed:
            return []
        taken.append(values)
        if len(taken) < needed:
            return []
        said = []
        for found in find_in_samples(self._nodes[node], np.arange(needed) / hz, np.array(taken)):
            line = f"{found.text}: {KINDS[found.name].remedy}"
            if found.severity == "error":
                self.wrong.setdefault(node, line)
            if found.severity != "note":
                said.append((t_ns, line))
        return said
