"""What IMUs read before anything moves: gravity upwards and in m/s2, and no rotation.

Cars stand while they wait to be armed. One whose IMU is upside down or counts in g would drive on
estimates that are wrong and say they hold.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tracking.constellation import NodeConfig
from tracking.findings import KINDS
from tracking.findings.at_rest import find_in_samples

SECONDS = 2.0
"""[s] So much of every IMU is looked at, once."""


class AtRest:
    """Looks at the first samples, node by node."""

    def __init__(self, nodes: Sequence[NodeConfig]) -> None:
        """Begin with none; nodes by index."""
        self._nodes = nodes
        self._samples: dict[int, list[tuple[float, ...]]] = {}
        self.wrong: dict[int, str] = {}
        """What makes the IMU of a node of no use, by index."""

    def note(self, node: int, values: tuple[float, ...], t_ns: int) -> list[tuple[int, str]]:
        """Take a sample; the time and what is to be said of the node, once it is known.

        Args:
            node: Whose, by index.
            values: Angular rate and specific force.
            t_ns: When it came, by the host's clock [ns].
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
