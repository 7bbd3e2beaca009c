"""Weights of the reward terms; the reward is the sum of weight times term."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from relpos_env.errors import EnvError
from relpos_env.tasks.base import Task
from relpos_env.tasks.options import finite
from tracking.arrays import F64

_CARE = {"collision": 1.0, "effort": 0.05, "nearness": 0.5}
_MOVING = {"formation": 1.0, "velocity": 0.2, **_CARE}
# The time penalty exceeds the largest reward of a step, so finishing early is optimal.
_ENDING = {"formation": 0.5, "progress": 1.0, **_CARE, "time": 1.5}

DEFAULT_WEIGHTS: Mapping[str, Mapping[str, float]] = MappingProxyType(
    {
        "ring": {
            "formation": 1.0,
            "velocity": 0.0,
            "collision": 1.0,
            "effort": 0.0,
            "nearness": 0.0,
        },
        "hold": {"formation": 1.0, "place": 0.3, **_CARE, "progress": 5.0},
        "travel": {**_MOVING, "time": 1.2},
        "follow": {**_MOVING, "time": 1.2},
        "observe": {**_MOVING, "information": 1.0, "time": 1.2},
        "escort": _MOVING,
        "seek": _MOVING,
        "inspect": {"formation": 0.2, "velocity": 0.1, **_CARE, "time": 0.5, "coverage": 100.0},
        "gap": _ENDING,
        "rendezvous": _ENDING,
    }
)
"""Task to term to weight [-]; `time` is ignored for tasks without an end."""


def reward_weights(name: object, task: Task, override: Mapping[str, float] | None = None) -> F64:
    """Return the weights in the order of a task's terms, (term).

    Args:
        name: Name or builder of the task.
        task: Built-in tasks use `DEFAULT_WEIGHTS`, others `Task.default_weights`.
        override: Weights by term that replace the defaults.

    Raises:
        EnvError: Unknown term, or a weight that is not finite.
    """
    ours = DEFAULT_WEIGHTS.get(name) if isinstance(name, str) else None
    for term in () if ours else task.default_weights:
        if term not in task.terms:
            raise EnvError(
                f"default_weights of {type(task).__name__}: expected terms among "
                f"{', '.join(task.terms)}, got {term!r}"
            )
    chosen = {**dict.fromkeys(task.terms, 1.0), **(ours or task.default_weights)}
    for term, weight in (override or {}).items():
        if term not in task.terms:
            raise EnvError(f"weights: expected terms among {', '.join(task.terms)}, got {term!r}")
        chosen[term] = finite(f"weights: {term}", weight)
    return np.array([chosen[term] for term in task.terms])
