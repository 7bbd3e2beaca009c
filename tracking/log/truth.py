"""True positions and orientations of a recorded run, at their own times."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tracking.arrays import F64, I64, Bool
from tracking.constellation import Constellation
from tracking.params.short_repr import short_repr

MAX_GAP = 0.5
"""[s] Longest gap over which the truth of a moving node is interpolated."""


@dataclass(frozen=True, slots=True)
class Truth:
    """One row per node and time, in time order."""

    __repr__ = short_repr

    t: F64
    """Times, (row) [s]."""
    node: I64
    """Node index, (row)."""
    pos_w: F64
    """Positions, (row, 3) [m]."""
    q_wb: F64
    """Orientations, (row, 4)."""
    has_orientation: Bool
    """True if the orientation is known, (row)."""
    valid: Bool
    """False if the row must not be scored, (row)."""

    @classmethod
    def empty(cls) -> Truth:
        """Return a truth without rows."""
        no = np.zeros(0, dtype=bool)
        return cls(
            np.zeros(0), np.zeros(0, dtype=np.int64), np.zeros((0, 3)), np.zeros((0, 4)), no, no
        )

    def times(self) -> F64:
        """Return the distinct times of valid rows, ascending, (time) [s]."""
        return np.unique(self.t[self.valid])

    def positions(self, constellation: Constellation, t: F64) -> tuple[F64, Bool]:
        """Return the position of every node at given times, linearly interpolated.

        Args:
            constellation: Nodes of the run.
            t: Times, (time) [s].

        Returns:
            Positions, (time, node, 3) [m], and a mask of known ones, (time, node): between rows at
            most `MAX_GAP` apart, or at any time for a static node.
        """
        pos = np.zeros((len(t), constellation.n_nodes, 3))
        known = np.zeros((len(t), constellation.n_nodes), dtype=bool)
        for n in range(constellation.n_nodes):
            rows = np.nonzero(self.valid & (self.node == n))[0]
            if len(rows) == 0:
                continue
            t_n, pos_n = self.t[rows], self.pos_w[rows]
            if constellation.is_static[n]:
                pos[:, n], known[:, n] = pos_n.mean(axis=0), True
                continue
            for k in range(3):
                pos[:, n, k] = np.interp(t, t_n, pos_n[:, k])
            after = np.searchsorted(t_n, t, side="left").clip(0, len(t_n) - 1)
            before = np.maximum(after - 1, 0)
            exact = t_n[after] == t
            inside = (t >= t_n[0]) & (t <= t_n[-1])
            known[:, n] = exact | (inside & (t_n[after] - t_n[before] <= MAX_GAP))
        return pos, known

    def pairs(self, constellation: Constellation, t: F64) -> tuple[F64, Bool]:
        """Return true relative positions, (time, pair, 3) [m], and a mask of known ones."""
        pos, known = self.positions(constellation, t)
        i, j = constellation.pairs.T
        return pos[:, j] - pos[:, i], known[:, i] & known[:, j]
