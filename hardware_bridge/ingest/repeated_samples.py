"""Detection of repeated samples: a message received twice, or a frozen sensor.

Copies of numbered messages are detected by their numbers. Without numbers, the same sample before
the next one can have been measured is a copy: integrated, it would count a rotation twice.

A sensor whose own bus hangs repeats its last sample forever. Each sample is plausible by itself,
and the heading integrated from them diverges. A working sensor has noise: its axes do not all stay
the same to the last bit for long.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from hardware_bridge.readings import Source

STUCK = 0.25
"""[s] Duration of identical samples that counts as frozen. Devices that send faster than they
measure also repeat samples, for less than 0.2 s."""
FEWEST = 5
"""[-] Smallest number of identical samples that counts as frozen, for slow streams."""
SOON = 0.5
"""[-] Fraction of a period after which the next sample may arrive."""


@dataclass(slots=True)
class _Held:
    """Last values of a node."""

    values: tuple[float, ...]
    since_ns: int
    last_ns: int
    n: int = 1


class RepeatedSamples:
    """Detector of repeated samples, node by node.

    Invariants: a sample that differs from the previous one is always accepted; identical samples
    are refused after `STUCK` and at least `FEWEST` of them.
    """

    def __init__(self, rates: Sequence[float]) -> None:
        """Create a detector without samples.

        Args:
            rates: Sample rates of the nodes, by index [1/s].
        """
        self._soon_ns = [round(SOON * 1e9 / rate) for rate in rates]
        self._held: dict[int, _Held] = {}
        self.stuck: set[int] = set()
        """Nodes whose last sample was refused because of a frozen sensor."""

    def refusal(self, node: int, source: Source, values: tuple[float, ...], t_ns: int) -> str:
        """Return the reason to refuse a sample: ``duplicate`` or ``stuck``; empty if none.

        Args:
            node: Index of the node.
            source: Source of the message.
            values: All values of the sensor.
            t_ns: Arrival, by the host's clock [ns].
        """
        held = self._held.get(node)
        if held is None or held.values != values:
            self._held[node] = _Held(values, t_ns, t_ns)
            self.stuck.discard(node)
            return ""
        unnumbered = source.sequence is None and source.ticks is None
        if unnumbered and t_ns - held.last_ns < self._soon_ns[node]:
            return "duplicate"
        held.n, held.last_ns = held.n + 1, t_ns
        if held.n < FEWEST or t_ns - held.since_ns < STUCK * 1e9:
            return ""
        self.stuck.add(node)
        return "stuck"
