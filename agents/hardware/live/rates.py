"""Rates of the samples and ranges of each node."""

from __future__ import annotations

from collections import deque

import numpy as np

from tracking.arrays import F64, I64
from tracking.measurements import Kind, MeasurementBlock

WINDOW = 2.0
"""[s] Averaging window of the rates."""


class Rates:
    """Rates over the last seconds by node index."""

    def __init__(self, n_nodes: int) -> None:
        self._n = n_nodes
        self._now = self._nothing()
        self._first: float | None = None
        self._closed = 0.0
        self._recent: deque[tuple[float, float, I64]] = deque()
        """Start and end [s] of each step, with its counts."""
        self.totals: dict[str, int] = {kind.name.lower(): 0 for kind in _COUNTED}
        """Measurements since the start, by kind."""

    def take(self, block: MeasurementBlock) -> None:
        """Count the measurements of a block of one environment."""
        valid = block.valid[0]
        kind, i, j = block.kind[0][valid], block.i[0][valid], block.j[0][valid]
        motion, ranged = np.isin(kind, (Kind.IMU, Kind.STATE)), kind == Kind.RANGE
        for row, nodes in ((0, i[motion]), (1, i[ranged]), (1, j[ranged])):
            self._now[row] += np.bincount(nodes, minlength=self._n)
        for each in _COUNTED:
            self.totals[each.name.lower()] += int(np.sum(kind == each))

    def close(self, t: float) -> None:
        """End a step at a time [s]; it has the counts since the last call."""
        if self._first is None:
            # The duration of the first step is unknown.
            self._first, self._closed, self._now = t, t, self._nothing()
            return
        self._recent.append((self._closed, t, self._now))
        self._closed, self._now = t, self._nothing()
        while self._recent[0][1] <= t - WINDOW:
            self._recent.popleft()

    @property
    def hz(self) -> F64:
        """[1/s] Rates of samples and ranges, (2, node); zeros before the second step."""
        if not self._recent or self._first is None:
            return np.zeros((2, self._n))
        # Time since the start of the oldest step, which may exceed the window slightly.
        elapsed = self._recent[-1][1] - self._recent[0][0]
        total = np.sum([counts for _, _, counts in self._recent], axis=0)
        hz: F64 = total / max(elapsed, 1e-3)
        return hz

    def _nothing(self) -> I64:
        return np.zeros((2, self._n), dtype=np.int64)


_COUNTED = (Kind.IMU, Kind.MAG, Kind.STATE, Kind.RANGE)
