"""Places that stay the same to the last bit while the car drives: another tracker that hangs.

A tracker of positions that writes its last lines for ever, with or without new stamps, would have
cars believe for ever that they are where they were. Each line is plausible by itself. Measured
places of what moves differ, if only by noise.
"""

from __future__ import annotations

from dataclasses import dataclass

LONG = 0.25
"""[s] The same for so long, of something that drives."""
FEWEST = 5
"""[-] And as many lines."""
DRIVES = 0.2
"""[m/s] What is faster must change its place within `LONG` in any tracker's digits."""


@dataclass(slots=True)
class _Held:
    """What was told last."""

    values: tuple[float, ...]
    since_ns: int
    n: int = 1


class StuckPlaces:
    """Tells places that hang from others, pair by pair and node by node.

    Laws: a place that differs from the one before is always taken; of places that never differ
    none is taken once the node, or one of the pair, has driven for `LONG` and `FEWEST` lines, and
    none after that, driving or not.
    """

    def __init__(self) -> None:
        """Begin with nothing told."""
        self._held: dict[tuple[int, ...], _Held] = {}
        self.stuck: set[tuple[int, ...]] = set()
        """Of what the last place was refused."""

    def refuses(
        self, nodes: tuple[int, ...], values: tuple[float, ...], drives: bool, t_ns: int
    ) -> bool:
        """Whether a place is not to be believed.

        Args:
            nodes: Whose, by index; one, or a pair.
            values: All that was told of it.
            drives: Whether one of them moves, by its wheels or by what it was let do.
            t_ns: When it came, by the host's clock [ns].
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
