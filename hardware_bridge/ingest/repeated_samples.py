"""Samples that are the one before once more: a message that came twice, or a sensor that is stuck.

Where messages have numbers, copies are found by these. Where they have none, the same sample again
before the next one could have been measured is a copy: integrated, it would turn the node twice.

A sensor whose own bus hangs repeats its last sample for ever. Each is plausible by itself, and a
heading that is integrated from them runs away. A sensor that works has noise: all its axes do not
stay the same, to the last bit, for long.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from hardware_bridge.readings import Source

STUCK = 0.25
"""[s] The same numbers for so long. Devices that send more often than they measure repeat them
too, for less than 0.2 s."""
FEWEST = 5
"""[-] And as many samples, for streams that are slow."""
SOON = 0.5
"""[-] Of a period, after which the next sample may come."""


@dataclass(slots=True)
class _Held:
    """The last numbers of a node."""

    values: tuple[float, ...]
    since_ns: int
    last_ns: int
    n: int = 1


class RepeatedSamples:
    """Tells repeated samples from others, node by node.

    Laws: a sample that differs from the one before is always taken; of samples that never differ
    none is taken after `STUCK`, once there were `FEWEST`.
    """

    def __init__(self, rates: Sequence[float]) -> None:
        """Begin without samples.

        Args:
            rates: Of the nodes' samples, by index [1/s].
        """
        self._soon_ns = [round(SOON * 1e9 / rate) for rate in rates]
        self._held: dict[int, _Held] = {}
        self.stuck: set[int] = set()
        """Nodes whose last sample was refused because the sensor is."""

    def refusal(self, node: int, source: Source, values: tuple[float, ...], t_ns: int) -> str:
        """Why a sample is not to be used: ``duplicate`` or ``stuck``; empty if it is.

        Args:
            node: Whose, by index.
            source: Of the message.
            values: All that the sensor measured.
            t_ns: When it came, by the host's clock [ns].
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
