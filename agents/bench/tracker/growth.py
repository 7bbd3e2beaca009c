"""Time of a step over the number of nodes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from agents.bench.tracker.ours import step_cost
from agents.bench.tracker.peer_filterpy import filterpy_name, group_cost
from agents.bench.tracker.peer_gtsam import gtsam_name, smoother_cost
from agents.bench.tracker.workload import Workload
from tracking.filters import DEFAULT_FILTER

SIZES = (2, 3, 4, 6, 8, 10, 15, 20, 30, 50)
GTSAM_UP_TO = 20
"""[-] Largest number of nodes for GTSAM, whose smoother takes seconds per step beyond."""


@dataclass(frozen=True)
class Growth:
    """Times of a message of cars: one prediction, and ranges to half the group."""

    n: tuple[int, ...]
    """[-] Numbers of nodes."""
    ours: list[float]
    """[us] Times of a message in the joint filter."""
    ranges: list[int]
    """[-] Ranges per message."""
    peers: dict[str, list[float | None]]
    """[us] Times of a message in each peer, by its name; None if not measured."""


def growth(
    *,
    sizes: tuple[int, ...] = SIZES,
    steps: int = 200,
    progress: Callable[[float], None] | None = None,
) -> Growth:
    """Measure the time of a message over the number of nodes, for the tracker and its peers.

    Args:
        sizes: Numbers of nodes.
        steps: Timed messages; more for groups larger than this number.
        progress: Called with the share done, 0 to 1.
    """
    filterpy, gtsam = filterpy_name(), gtsam_name()
    peers: dict[str, list[float | None]] = {name: [] for name in (filterpy, gtsam) if name}
    result = Growth(sizes, [], [], peers)
    for k, n in enumerate(sizes):
        workload = Workload(n, 2, "message")
        few = max(min(steps, 400 // n), 1)
        result.ours.append(step_cost(workload, DEFAULT_FILTER, max(steps, n)))
        result.ranges.append(workload.pairs.shape[1])
        peers[filterpy].append(group_cost(workload, few if n < 20 else 1))
        if gtsam is not None:
            theirs = smoother_cost(workload, few) if n <= GTSAM_UP_TO else None
            peers[gtsam].append(theirs)
        if progress is not None:
            progress((k + 1) / len(sizes))
    return result
