"""Run all experiments with the ranging protocol (`relpos protocol`)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from agents.bench.radio import radio_cost
from agents.errors import UsageError
from agents.protocol.clock_error import measure_clock_error
from agents.protocol.rates import NODES, measure_rates
from agents.protocol.recovery import MODES, measure_recovery
from agents.protocol.timeline import Timeline, run_timeline
from tracking.params.short_repr import short_repr
from tracking.ranging.members import MAX_MEMBERS


@dataclass(frozen=True, slots=True)
class ProtocolResult:
    """Figures of all experiments."""

    __repr__ = short_repr

    rates: list[dict[str, Any]]
    recovery: list[dict[str, Any]]
    clock: list[dict[str, Any]]
    cost: list[dict[str, Any]]
    times: dict[tuple[str, str], list[float]]
    """[s] All recovery times by event and mode."""
    timelines: list[Timeline]

    @property
    def records(self) -> list[dict[str, Any]]:
        """JSON records, one for each figure."""
        return [*self.rates, *self.recovery, *self.clock, *self.cost]


def protocol(
    *,
    events: int = 200,
    nodes: tuple[int, ...] = NODES,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
) -> ProtocolResult:
    """Measure rates, recovery and clock errors of the ranging protocol.

    Args:
        events: Number of events of each kind and mode.
        nodes: Sizes of the groups for the rate measurement.
        seed: Seed; the same seed gives the same figures.
        progress: Called with the share done, 0 to 1.

    Raises:
        UsageError: A number is out of range; the message names the argument.
    """
    if not 1 <= events <= 100_000:
        raise UsageError(f"--events: expected 1 to 100000, got {events}")
    if seed < 0:
        raise UsageError(f"--seed: expected 0 or more, got {seed}")
    for n in nodes:
        if not 2 <= n <= MAX_MEMBERS:
            raise UsageError(f"--nodes: expected 2 to {MAX_MEMBERS}, got {n}")
    nodes = tuple(dict.fromkeys(nodes))
    report = progress or (lambda share: None)
    timelines = [run_timeline(seed, mode) for mode in MODES]
    recovery, times = measure_recovery(seed, events, lambda share: report(0.3 * share))
    clock = measure_clock_error(seed)
    cost = [
        {"experiment": "cost", "n": n, "us_per_round": radio_cost(n, max(4, 2000 // n**2))[0]}
        for n in nodes
    ]
    rates = measure_rates(seed, nodes, lambda share: report(0.3 + 0.7 * share))
    report(1.0)
    return ProtocolResult(rates, recovery, clock, cost, times, timelines)
