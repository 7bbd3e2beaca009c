"""The delayed horizon: late and out-of-order measurements become an ordered stream.

Measurements are held back for a fixed delay (100 ms in the paper, accumulated by its
upstream filters) and handed on in time order. One that is later than the delay cannot be put
in order any more: it is dropped and counted.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tracking.arrays import F64, I64, Bool
from tracking.measurements import MeasurementBlock


@dataclass(frozen=True, slots=True, kw_only=True)
class HorizonParams:
    """How long measurements are held back."""

    delay: float = 0.1
    """[s] Longer puts later measurements in order, and makes every estimate older."""


class Horizon:
    """A buffer in front of the tracker.

    Law: the stream that comes out does not depend on the order or the blocks in which
    measurements came in, as long as none is later than the delay.
    """

    def __init__(self, params: HorizonParams, n_envs: int = 1) -> None:
        self._params = params
        self._n_envs = n_envs
        self._pending = MeasurementBlock.empty(n_envs)
        self._released = np.full(n_envs, -np.inf)
        self.n_late = np.zeros(n_envs, dtype=np.int64)
        """Measurements dropped because they came too late, (env)."""
        self.n_doubled = np.zeros(n_envs, dtype=np.int64)
        """Measurements dropped because they had come before, (env)."""

    @property
    def waiting(self) -> MeasurementBlock:
        """Measurements that came and were not handed on yet, in order."""
        return self._pending

    @property
    def t(self) -> F64:
        """Time up to which measurements were handed on, (env) [s]."""
        return self._released.copy()

    def step(self, block: MeasurementBlock, now: F64 | float) -> MeasurementBlock:
        """Take what arrived and hand on, in order, everything older than the delay.

        Args:
            block: Measurements that arrived, in any order.
            now: Current time, scalar or (env) [s]; must not go back.

        Returns:
            The measurements up to ``now - delay``, sorted.
        """
        until = np.broadcast_to(np.asarray(now, dtype=np.float64), (self._n_envs,))
        return self._release(block, until - self._params.delay)

    def flush(self) -> MeasurementBlock:
        """Hand on all that is left, at the end of a stream."""
        return self._release(MeasurementBlock.empty(self._n_envs), np.full(self._n_envs, np.inf))

    def reset(self, env: int) -> None:
        """Forget what one environment still held."""
        self._pending.valid[env] = False
        self._released[env] = -np.inf
        self.n_late[env] = 0

    def _release(self, block: MeasurementBlock, until: F64) -> MeasurementBlock:
        late = block.valid & (block.t <= self._released[:, None])
        self.n_late += late.sum(axis=1)
        fresh = replace(block, valid=block.valid & ~late)
        waiting = MeasurementBlock.concatenate([self._pending, fresh]).sorted()
        doubled = _same_as_before(waiting)
        self.n_doubled += doubled.sum(axis=1)
        waiting = replace(waiting, valid=waiting.valid & ~doubled)
        due = waiting.valid & (waiting.t <= until[:, None])
        self._released = np.maximum(self._released, until)
        self._pending = _compact(waiting, waiting.valid & ~due)
        return _compact(waiting, due)


def _same_as_before(block: MeasurementBlock) -> Bool:
    """True for events that equal the one before them in everything, (env, event)."""
    same = np.zeros(block.t.shape, dtype=bool)
    if block.n_events < 2:
        return same
    same[:, 1:] = block.valid[:, 1:] & block.valid[:, :-1]
    for field in (block.t, block.kind, block.i, block.j, block.antenna_i, block.antenna_j):
        same[:, 1:] &= field[:, 1:] == field[:, :-1]
    same[:, 1:] &= (block.values[:, 1:] == block.values[:, :-1]).all(axis=-1)
    return same


def _compact(block: MeasurementBlock, keep: Bool) -> MeasurementBlock:
    """The kept events moved to the front, with no more padding than needed."""
    n: I64 = keep.sum(axis=1)
    kept = replace(block, valid=keep).sorted()
    return kept.take(slice(0, int(n.max(initial=0))))
