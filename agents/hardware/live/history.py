"""History of the estimates of a run."""

from __future__ import annotations

import numpy as np

from tracking.arrays import F64, I64
from tracking.constellation import Constellation
from tracking.estimate import TeamEstimate


class History:
    """List of estimates that is converted to arrays on request."""

    def __init__(self, group: Constellation) -> None:
        self._group = group
        self._t_ns: list[int] = []
        self._t: list[float] = []
        self._arrays: list[tuple[F64, ...]] = []

    def add(self, t_ns: int, estimate: TeamEstimate) -> None:
        """Append a copy of an estimate.

        Args:
            t_ns: Host time of the decision [ns].
            estimate: Estimate of one environment, arrays (1, ...).
        """
        self._t_ns.append(t_ns)
        self._t.append(float(estimate.t[0]))
        self._arrays.append(tuple(array[0].copy() for array in estimate.arrays))

    @property
    def t_ns(self) -> I64:
        """[ns] Host times of the decisions, (time)."""
        return np.array(self._t_ns, dtype=np.int64)

    @property
    def estimate(self) -> TeamEstimate:
        """All estimates, arrays (time, ...)."""
        if not self._t:
            return TeamEstimate.empty(self._group, np.zeros(0))
        stacked = (np.stack(column) for column in zip(*self._arrays, strict=True))
        return TeamEstimate(self._group, np.array(self._t), *stacked)
