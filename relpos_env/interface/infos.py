"""What `info` says: the same keys in every form of the environment, flat, at every step.

| key | of a car | of a team |
|---|---|---|
| ``formation_error`` | of the others from their places, mean [m]; inf while absent | mean |
| ``tracking_error`` | distance of estimates from the truth, mean [m]; inf where none is | mean |
| ``tracked`` | others whose estimate can be used | mean |
| ``collisions`` | contacts begun in the step; not on hardware, which counts none | sum |
| ``present`` | in the room | of each car |
| ``active`` | takes part: in the room, or away and to return | of each car |
| ``is_success`` | the task is accomplished | the same |
| ``reward_<term>`` | what the term adds to the reward | mean |

Errors that there are not are infinite: equal to themselves, as the checkers of Gymnasium and
PettingZoo expect of two equal runs, and no perfect score.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from relpos_env.tasks.base import Task
from tracking.arrays import F64, Bool

Columns = dict[str, NDArray[Any]]
"""By key, arrays over (env, car) or (env)."""


def car_columns(
    task: Task,
    weights: F64,
    present: Bool,
    active: Bool,
    ok: Bool,
    *,
    collisions: F64 | None = None,
    tracking_error: F64 | None = None,
) -> Columns:
    """The figures of cars, (env, car).

    Args:
        task: With rewards and errors of now.
        weights: Of its terms, (term).
        present: (env, car)
        active: (env, car)
        ok: Where an estimate can be used, (env, car, other).
        collisions: Begun in the step, (env, car); None where nobody counts them.
        tracking_error: (env, car) [m], NaN where unknown; None where nobody knows the truth.
    """
    columns: Columns = {
        "formation_error": np.where(present, task.error, np.inf),
        "tracking_error": np.full(present.shape, np.inf)
        if tracking_error is None
        else np.where(np.isnan(tracking_error), np.inf, tracking_error),
        "tracked": ok.sum(axis=-1),
    }
    if collisions is not None:
        columns["collisions"] = collisions.astype(np.int64)
    columns["present"], columns["active"] = present, active
    columns["is_success"] = np.repeat(task.done[:, None], present.shape[1], axis=1)
    parts = task.rewards * weights
    for k, term in enumerate(task.terms):
        columns[f"reward_{term}"] = parts[..., k]
    return columns


def car_infos(columns: Columns, env: int, cars: Iterable[int]) -> list[dict[str, Any]]:
    """The info of each of some cars of an environment, in plain numbers."""
    rows = {key: column[env].tolist() for key, column in columns.items()}
    return [{key: row[k] for key, row in rows.items()} for k in cars]


def team_columns(columns: Columns) -> Columns:
    """The figures of teams, (env), and of their cars, (env, car)."""
    present, active = columns["present"], columns["active"]
    n_present, n_active = (np.maximum(a.sum(axis=1), 1) for a in (present, active))
    team: Columns = {}
    for key, column in columns.items():
        if key in ("present", "active"):
            team[key] = column.copy()
        elif key == "collisions":
            team[key] = column.sum(axis=1)
        elif key == "is_success":
            team[key] = column[:, 0]
        elif key == "tracked":
            team[key] = (column * present).sum(axis=1) / n_present
        elif key in ("stopped", "gate"):
            team[key] = column
        elif key.startswith("reward_"):
            team[key] = (column * active).sum(axis=1) / n_active
        else:
            team[key] = _mean_of_known(column)
    return team


def team_info(team: Columns, env: int) -> dict[str, Any]:
    """The info of one team: plain numbers, and arrays over its cars."""
    return {
        key: column[env].item() if column.ndim == 1 else column[env] for key, column in team.items()
    }


def vector_infos(team: Columns, envs: Bool | None = None) -> dict[str, Any]:
    """Infos as vector environments have them: each key with a mask of where it is.

    Args:
        team: Of all environments.
        envs: Of which they are wanted, (env); the others have zeros. None are all.
    """
    infos: dict[str, Any] = {}
    for key, column in team.items():
        mask = np.ones(len(column), dtype=bool) if envs is None else envs.copy()
        if envs is not None:
            column = np.where(envs.reshape(-1, *[1] * (column.ndim - 1)), column, 0)
            column = column.astype(team[key].dtype)
        infos[key], infos[f"_{key}"] = column, mask
    return infos


def _mean_of_known(column: F64) -> F64:
    """Mean of what is finite in each row, infinite where nothing is, (env)."""
    known = np.isfinite(column)
    n = known.sum(axis=1)
    total = np.where(known, column, 0.0).sum(axis=1)
    mean: F64 = np.where(n > 0, total / np.maximum(n, 1), np.inf)
    return mean
