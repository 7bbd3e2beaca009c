"""How often inertial samples come, next to how often the configuration says.

Orientations are filtered sample by sample at the configured rate: with a wrong one their time
constants are wrong by that factor and they lag behind turns, and nothing else tells.
"""

from __future__ import annotations

from collections.abc import Sequence

WINDOW = 1.0
"""[s] Over which samples are counted."""
BACKLOG = 0.5
"""[s] What comes at first is not counted: a port hands on at once what it has kept."""
PAUSE = 0.5
"""[s] After a longer one they are counted again."""
OFF = 0.3
"""[-] A rate that differs by more is another one. What comes in bunches, or is lost, is within it;
rates that were mistaken differ by a factor of two."""


def is_off(rate: float, configured: float) -> bool:
    """Whether samples come at another rate than the configured one [1/s]."""
    return abs(rate - configured) > OFF * configured


class SampleRates:
    """Counts samples, node by node."""

    def __init__(self, configured: Sequence[float]) -> None:
        """Begin with none.

        Args:
            configured: Rates, by index of the node [1/s].
        """
        self._configured = configured
        self._counted: dict[int, tuple[int, int, int]] = {}
        self._doubted: set[int] = set()
        self.rate: dict[int, float] = {}
        """Of the last whole window [1/s]; a wrong one only after the second in a row."""

    def note(self, node: int, t_ns: int) -> bool:
        """Count a sample; whether it ends a window that was the first of a wrong rate.

        Args:
            node: Whose, by index.
            t_ns: When it came, by the host's clock [ns].
        """
        begins = t_ns + round(BACKLOG * 1e9)
        first_ns, last_ns, n = self._counted.get(node, (begins, t_ns, 0))
        if t_ns - last_ns > PAUSE * 1e9:
            first_ns, n = begins, 0
        if t_ns - first_ns < WINDOW * 1e9:
            self._counted[node] = first_ns, t_ns, n + (t_ns >= first_ns)
            return False
        rate = n / ((t_ns - first_ns) * 1e-9)
        self._counted[node] = t_ns, t_ns, 1
        if is_off(rate, self._configured[node]) and node not in self._doubted:
            self._doubted.add(node)
            return False
        was_off = self.is_off(node)
        self.rate[node] = rate
        if not self.is_off(node):
            self._doubted.discard(node)
        return self.is_off(node) and not was_off

    def is_off(self, node: int) -> bool:
        """Whether a node was found to have another rate than the configured one."""
        return node in self.rate and is_off(self.rate[node], self._configured[node])

    def is_open(self, node: int) -> bool:
        """Whether a node has begun to send samples, and its rate is not known yet."""
        return node in self._counted and node not in self.rate
