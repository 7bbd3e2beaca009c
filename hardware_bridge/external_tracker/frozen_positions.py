"""Detection of frozen positions: identical to the last bit while the car drives.

An external tracker that repeats its last lines forever, with or without new stamps, would keep the
estimates of cars at their last positions. Each line is plausible by itself. Measured positions of
moving objects differ, if only by noise.
"""

from __future__ import annotations

from dataclasses import dataclass

LONG = 0.25
"""[s] Duration of identical positions of a driving node that counts as frozen."""
FEWEST = 5
"""[-] Smallest number of identical lines that counts as frozen."""
DRIVES = 0.2
"""[m/s] Above this speed a position must change within `LONG` at any tracker's resolution."""


@dataclass(slots=True)
class _Held:
    """Last reported values."""

    values: tuple[float, ...]
    since_ns: int
    n: int = 1


class StuckPlaces:
    """Detector of frozen positions, pair by pair and node by node.

    Invariants: a position that differs from the previous one is always accepted; identical
    positions are refused once the node, or one of the pair, has driven for `LONG` and `FEWEST`
    lines, and from then on, driving or not.
    """

    def __init__(self) -> None:
        """Create a detector without reports."""
        self._held: dict[tuple[int, ...], _Held] = {}
        self.stuck: set[tuple[int, ...]] = set()
        """Nodes and pairs whose last position was refused."""

    def refuses(
        self, nodes: tuple[int, ...], values: tuple[float, ...], drives: bool, t_ns: int
    ) -> bool:
        """Return whether a position is refused.

        Args:
            nodes: Indices of the node or the pair.
            values: All reported values.
            drives: True if one of them moves, by its wheels or by its permitted commands.
            t_ns: Arrival, by the host's clock [ns].
        """
        held = self._held.get(nodes)
        if held is None or held.values != values:
            self._held[nodes] = _Held(values, t_ns)
            self.stuck.discard(nodes)
            return False
        if nodes in self.stuck:
            return True
        if not drives:
            held.since_ns, held.n = t_ns, 1
            return False
        held.n += 1
        if held.n < FEWEST or t_ns - held.since_ns < LONG * 1e9:
            return False
        self.stuck.add(nodes)
        return True
