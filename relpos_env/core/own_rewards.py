"""Rewards of tasks and terms from outside the package, which may be no numbers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from relpos_env.errors import EnvError
from relpos_env.tasks import Task
from tracking.arrays import F64, Bool


def check_task_rewards(name: object, task: Task) -> None:
    """Check the rewards of a task from outside the package.

    Raises:
        EnvError: A reward term is not a finite number.
    """
    finite = np.isfinite(task.rewards).all(axis=(0, 1))
    if not finite.all():
        term = task.terms[int(np.argmin(finite))]
        raise EnvError(f"task {name!r}, reward {term!r}: expected finite numbers")


def own_reward(term: Callable[[Any], Any], formation: Any, present: Bool) -> F64:
    """Return the reward of a term for the cars in the room, (env, car).

    Args:
        term: Function of the formation.
        formation: The `EnvCore`.
        present: True where the car is present, (env, car).

    Raises:
        EnvError: The term does not return a finite number for each car.
    """
    own = np.asarray(term(formation), dtype=np.float64)
    if own.shape != present.shape or not np.isfinite(own).all():
        raise EnvError(f"reward: expected finite numbers {present.shape}, got {own!r}")
    return np.asarray(np.where(present, own, 0.0))
