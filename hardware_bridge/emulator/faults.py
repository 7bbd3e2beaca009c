"""Random faults of frames on a line, as a pure queue."""

from __future__ import annotations

import heapq
from dataclasses import dataclass, fields

import numpy as np

from hardware_bridge.errors import BridgeError

MOST_FLIPS = 3
"""[-] Largest number of flipped bits in a damaged frame."""
N_DRAWS = 5
"""[-] Number of kinds of faults that are sampled for each frame."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultParams:
    """Probabilities of faults per frame, chosen by the authors; by default there are no faults."""

    loss: float = 0.0
    """[-] Share of frames that never arrive."""
    corruption: float = 0.0
    """[-] Share of frames in which one to three bits are flipped."""
    truncation: float = 0.0
    """[-] Share of frames that are cut off, by one byte up to all but one."""
    duplication: float = 0.0
    """[-] Share of frames that arrive twice."""
    reordering: float = 0.0
    """[-] Share of frames that are overtaken by those of the next `reordering_by` seconds."""
    reordering_by: float = 0.03
    """[s] Delay of reordered frames in addition to `delay`."""
    delay: float = 0.0
    """[s] Mean delay of a frame."""
    delay_spread: float = 0.0
    """[s] Standard deviation of the delay. Frames that are not reordered stay in order, as on any
    line: a late frame delays those behind it."""

    def __post_init__(self) -> None:
        for f in fields(self):
            value, most = getattr(self, f.name), 10.0 if f.name in _SECONDS else 1.0
            if not 0.0 <= value <= most:
                raise BridgeError(f"{f.name}: expected 0 to {most:g}, got {value!r}")


_SECONDS = ("reordering_by", "delay", "delay_spread")


class FaultInjector:
    """Queue that applies faults to frames.

    Invariants: without faults every frame comes out once, whole, in order and at once; a damaged
    frame is changed; the rate of one fault does not change which frames other faults affect.
    """

    def __init__(self, params: FaultParams, rng: np.random.Generator) -> None:
        """Create an empty queue.

        Args:
            params: Probabilities of faults.
            rng: Generator used by this queue only.
        """
        self.params = params
        self._calm = params == FaultParams(reordering_by=params.reordering_by)
        # Separate generators for kinds, delays and details of faults.
        self._what, self._when, self._how = rng.spawn(3)
        self._waiting: list[tuple[int, int, bytes]] = []
        self._order = 0
        self._last_ns = 0
        self.lost = self.damaged = self.doubled = self.reordered = 0
        """Number of frames affected so far."""

    def push(self, t_ns: int, frame: bytes) -> None:
        """Add a frame.

        Args:
            t_ns: Current host time.
            frame: Complete frame.
        """
        if not frame:
            return
        if self._calm:
            self._send(t_ns, frame)
            return
        p = self.params
        loss, corruption, truncation, duplication, reordering = self._what.random(N_DRAWS).tolist()
        delay = max(p.delay + p.delay_spread * float(self._when.standard_normal()), 0.0)
        # A lost frame still delays later ones: it was damaged on the line.
        self._last_ns = due_ns = max(self._last_ns, t_ns + round(1e9 * delay))
        if loss < p.loss:
            self.lost += 1
            return
        if corruption < p.corruption:
            frame = self._flipped(frame)
        short = truncation < p.truncation and len(frame) > 1
        if short:
            frame = frame[: int(self._how.integers(1, len(frame)))]
        self.damaged += corruption < p.corruption or short
        if reordering < p.reordering:
            self.reordered += 1
            due_ns += round(1e9 * p.reordering_by)
        self._send(due_ns, frame)
        if duplication < p.duplication:
            self.doubled += 1
            self._send(due_ns, frame)

    def due(self, t_ns: int) -> list[bytes]:
        """Return the frames that have arrived by now, in order of arrival."""
        arrived: list[bytes] = []
        while self._waiting and self._waiting[0][0] <= t_ns:
            arrived.append(heapq.heappop(self._waiting)[2])
        return arrived

    def forget(self) -> None:
        """Drop all frames in the queue."""
        self._waiting.clear()

    def _send(self, due_ns: int, frame: bytes) -> None:
        heapq.heappush(self._waiting, (due_ns, self._order, frame))
        self._order += 1

    def _flipped(self, frame: bytes) -> bytes:
        """Return the frame with some of its bits flipped, no bit twice."""
        n_bits = 8 * len(frame)
        n = int(self._how.integers(1, MOST_FLIPS + 1))
        damaged = bytearray(frame)
        for bit in self._how.choice(n_bits, size=min(n, n_bits), replace=False).tolist():
            damaged[bit // 8] ^= 1 << (bit % 8)
        return bytes(damaged)
