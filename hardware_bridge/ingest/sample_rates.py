"""Measured rates of inertial samples, compared with the configured ones.

The attitude filter runs at the configured rate: with a wrong one its time constants are wrong by
the same factor and attitudes lag behind rotations, without any other symptom.
"""

from __future__ import annotations

from collections.abc import Sequence

WINDOW = 1.0
"""[s] Duration over which samples are counted."""
BACKLOG = 0.5
"""[s] Initial time that is not counted: a port first delivers its backlog at once."""
PAUSE = 0.5
"""[s] Pause after which counting restarts."""
OFF = 0.3
"""[-] Relative deviation above which a rate is wrong. Bunching and losses stay within it; confused
rates differ by a factor of two."""


def is_off(rate: float, configured: float) -> bool:
    """Return whether a sample rate differs from the configured one [1/s]."""
    return abs(rate - configured) > OFF * configured


class SampleRates:
    """Counter of samples, node by node."""

    def __init__(self, configured: Sequence[float]) -> None:
        """Create a counter without samples.

        Args:
            configured: Configured rates, by index of the node [1/s].
        """
        self._configured = configured
        self._counted: dict[int, tuple[int, int, int]] = {}
        self._doubted: set[int] = set()
        self.rate: dict[int, float] = {}
        """Rate of the last complete window [1/s]; a wrong one only after the second in a row."""

    def note(self, node: int, t_ns: int) -> bool:
        """Count a sample; return whether it completes the window that confirms a wrong rate.

        Args:
            node: Index of the node.
            t_ns: Arrival, by the host's clock [ns].
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
        """Return whether a node was found to have another rate than the configured one."""
        return node in self.rate and is_off(self.rate[node], self._configured[node])

    def is_open(self, node: int) -> bool:
        """Return whether a node has begun to send samples and its rate is not known yet."""
        return node in self._counted and node not in self.rate
