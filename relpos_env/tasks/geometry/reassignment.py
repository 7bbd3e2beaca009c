"""Slots that are assigned again while cars drive, for cars that decide alone.

Every computer assigns slots by the positions that it estimates, so assignments can differ where two
are nearly as good. Repeated while the cars drive, they become the same: the cars' own motion
decides which one is better, and all computers see it.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from relpos_env.tasks.base import Task, Truth
from tracking.arrays import F64

GAIN = 0.05
"""[-] Share by which another assignment must be better, against changes by noise alone."""


class Reassignment:
    """Assignment of the slots of a task in one environment, repeated."""

    def __init__(self, make_task: Callable[[], Task]) -> None:
        """Build a second task, of one environment, whose assignment is compared."""
        self._other = make_task()

    def repeat(self, task: Task, state: Truth, t: F64, collided: F64) -> None:
        """Assign the slots of a task again if this is better; arguments as of `Task.update`."""
        here = slice(0, 1)
        self._other.reset(state, here)
        self._other.update(state, t, collided, here)
        if _cost(self._other, state) < (1.0 - GAIN) * _cost(task, state):
            task.reset(state, here)
            task.update(state, t, collided, here)


def _cost(task: Task, state: Truth) -> float:
    """Return the sum of squared distances from the slots, up to a common shift [m2]."""
    here = state.present[0]
    if not here.any():
        return 0.0
    off = state.pos_w[0, here] - task.goal_w[0, here]
    return float(np.square(off - off.mean(axis=0)).sum())
