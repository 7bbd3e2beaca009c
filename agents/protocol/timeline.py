"""Ranging frequency over time while nodes come and go: the experiment of the paper's figure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from agents.protocol.group import Group, radio_params
from tracking.ranging.wire import Type

SCRIPT = (
    (1.0, "a responder joins", 5, True),
    (2.5, "it drops out", 5, False),
    (4.0, "a smaller ID joins", 0, True),
    (5.5, "it drops out", 0, False),
)
"""Time [s], what happens, node, whether it is switched on; nodes 1 to 4 are there all along."""
END = 8.0
"""[s]"""


@dataclass(frozen=True, slots=True)
class Timeline:
    """Rounds of one run."""

    mode: str
    t: list[float]
    """Begin of each round [s]."""
    n: list[int]
    """Members of each round."""

    @property
    def hz(self) -> list[float]:
        """Frequency of the rounds, from each begin to the next."""
        return [1.0 / (b - a) for a, b in zip(self.t[:-1], self.t[1:], strict=True)]


def run_timeline(seed: int, mode: str) -> Timeline:
    """Let the script run off, once the first four nodes have found together."""
    rng = np.random.default_rng([seed, 99])
    group = Group(radio_params(succession=mode == "succession"), 6, rng)
    for k in range(1, 5):
        group.switch_on(k, float(rng.uniform(0.0, 0.02)))
    group.assemble(range(1, 5), limit=20.0)
    group.listen()
    start = group.t
    for t, _, node, on in SCRIPT:
        group.run(start + t - group.t)
        if on:
            group.switch_on(node)
        else:
            group.air.switch_off(node)
    group.run(start + END - group.t)
    rounds = [h for h in group.listen() if h.frame.type is Type.REQUEST]
    return Timeline(mode, [h.start - start for h in rounds], [h.frame.n for h in rounds])
