"""Ranging rate over time while nodes join and leave, as in a figure of the paper."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from agents.protocol.group import Group, radio_params
from tracking.arrays import F64
from tracking.params.short_repr import short_repr
from tracking.ranging.frames.wire import Type

SCRIPT = (
    (1.0, "a responder joins", 5, True),
    (2.5, "it drops out", 5, False),
    (4.0, "a smaller ID joins", 0, True),
    (5.5, "it drops out, the initiator", 0, False),
)
"""Time [s], event, node, and whether it is switched on; nodes 1 to 4 are always on."""
END = 8.0
"""[s] End of the experiment."""


BIN = 0.1
"""[s] Bin width of the counts of rounds."""
RUNS = 10
"""[-] Number of averaged groups."""


@dataclass(frozen=True, slots=True)
class Timeline:
    """Ranging rate over time in one mode."""

    __repr__ = short_repr

    mode: str
    t: F64
    """[s] Centre of each bin."""
    hz: F64
    """[Hz] Rate of complete rounds, with messages of all switched-on nodes."""


def run_timeline(seed: int, mode: str) -> Timeline:
    """Run the script in several groups, starting after their first four nodes are assembled."""
    edges = np.arange(0.0, END + 0.5 * BIN, BIN)
    ends = np.concatenate([_whole_rounds(seed, mode, k) for k in range(RUNS)])
    count, _ = np.histogram(ends, edges)
    return Timeline(mode, edges[:-1] + 0.5 * BIN, count / (RUNS * BIN))


def _whole_rounds(seed: int, mode: str, k: int) -> F64:
    """Return the ends of the complete rounds, with messages of all switched-on nodes [s]."""
    rng = np.random.default_rng([seed, 99, k])
    group = Group(radio_params(succession=mode == "succession"), 6, rng)
    for node in range(1, 5):
        group.switch_on(node, float(rng.uniform(0.0, 0.02)))
    group.assemble(range(1, 5), limit=20.0)
    group.run(float(rng.uniform(0.0, 0.1)))
    group.listen()
    start = group.t
    for t, _, node, on in SCRIPT:
        group.run(start + t - group.t)
        if on:
            group.switch_on(node)
        else:
            group.air.switch_off(node)
    group.run(start + END - group.t)
    ends, sources = [], set[int]()
    for h in group.listen():
        if h.frame.type is Type.REQUEST:
            sources = set()
        sources.add(h.frame.src)
        here = {1, 2, 3, 4} | {k for t, _, k, powered in SCRIPT if powered and t <= h.end - start}
        here -= {k for t, _, k, powered in SCRIPT if not powered and t <= h.end - start}
        if h.frame.type is not Type.JOIN and sources >= here:
            ends.append(h.end - start)
            sources = set()
    return np.array(ends)
