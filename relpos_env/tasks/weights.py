"""How much each reward term counts; the reward is the sum of weight times term."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from relpos_env.errors import EnvError
from relpos_env.registry import look_up
from relpos_env.tasks.options import finite
from tracking.arrays import F64

_CARE = {"collision": 1.0, "effort": 0.05, "nearness": 0.5}
_MOVING = {"formation": 1.0, "velocity": 0.2, **_CARE}
# Every step costs more than a perfect one earns, so that being through is best.
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
        "gap": _ENDING,
        "rendezvous": _ENDING,
    }
)
"""Task to term to weight [-]; `time` counts only where the task has an end."""


def reward_weights(
    task: str, terms: tuple[str, ...], override: Mapping[str, float] | None = None
) -> F64:
    """Weights in the order of a task's terms, (term).

    Args:
        task: Name of the task.
        terms: Its `terms`.
        override: Weights by name that differ from the default.

    Raises:
        EnvError: No term of that name, or a weight that is not finite.
    """
    chosen = dict(look_up(DEFAULT_WEIGHTS, task, "task"))
    for name, weight in (override or {}).items():
        if name not in terms:
            raise EnvError(f"weights: expected terms among {', '.join(terms)}, got {name!r}")
        chosen[name] = finite(f"weights: {name}", weight)
    return np.array([chosen[name] for name in terms])
