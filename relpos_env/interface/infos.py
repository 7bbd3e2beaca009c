"""Keys of `info`: the same in every environment class, flat, at every step.

| key | value of a car | value of a team |
|---|---|---|
| ``formation_error`` | mean distance of others from their targets [m]; inf while absent | mean |
| ``tracking_error`` | mean error of the estimates [m]; inf without estimates | mean |
| ``disagreement`` | RMS of the difference of two cars' estimates of each other [m] | mean |
| ``tracked`` | number of others with a usable estimate | mean |
| ``collisions`` | number of contacts begun in the step; not on hardware | sum |
| ``present`` | True if in the room | per car |
| ``active`` | True if in the room or temporarily absent | per car |
| ``is_success`` | True if the task is done | the same |
| ``reward_<term>`` | weighted reward term | mean |

Missing errors are infinite: unlike NaN, inf equals itself, which the checkers of Gymnasium and
PettingZoo need to compare two runs; 0 would be a perfect score.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracking.arrays import F64, I64, Bool

Columns = dict[str, NDArray[Any]]
"""Arrays over (env, car) or (env), by key."""


class Figures(NamedTuple):
    """Info values of cars, arrays over (env, car)."""

    formation_error: F64
    tracking_error: F64
    disagreement: F64
    tracked: I64
    collisions: I64
    is_success: Bool
    parts: F64
    """Weighted reward terms, (env, car, term)."""


def make_figures(n_envs: int, n_cars: int, n_terms: int) -> Figures:
    """Allocate the info values."""
    shape = n_envs, n_cars
    return Figures(
        np.zeros(shape),
        np.zeros(shape),
        np.zeros(shape),
        np.zeros(shape, dtype=np.int64),
        np.zeros(shape, dtype=np.int64),
        np.zeros(shape, dtype=bool),
        np.zeros((*shape, n_terms)),
    )


def car_columns(
    figures: Figures, terms: Sequence[str], present: Bool, active: Bool, *, counted: bool = True
) -> Columns:
    """Return the info values of cars by key, as views of the arrays.

    Args:
        figures: Values written by `write_figures`.
        terms: Names of the task's reward terms.
        present: True where the car is present, (env, car).
        active: True where the car is present or temporarily absent, (env, car).
        counted: True if collisions are counted.
    """
    columns: Columns = {
        "formation_error": figures.formation_error,
        "tracking_error": figures.tracking_error,
        "disagreement": figures.disagreement,
        "tracked": figures.tracked,
        "collisions": figures.collisions,
        "present": present,
        "active": active,
        "is_success": figures.is_success,
    }
    if not counted:
        del columns["collisions"]
    return columns | {f"reward_{term}": figures.parts[..., k] for k, term in enumerate(terms)}


def car_infos(columns: Columns, env: int, cars: Iterable[int]) -> list[dict[str, Any]]:
    """Return the infos of some cars of an environment, as Python numbers."""
    rows = {key: column[env].tolist() for key, column in columns.items()}
    return [{key: row[k] for key, row in rows.items()} for k in cars]


def team_columns(columns: Columns) -> Columns:
    """Return the info values of teams, (env), and of their cars, (env, car)."""
    present, active = columns["present"], columns["active"]
    n_present, n_active = (np.maximum(a.sum(axis=1), 1) for a in (present, active))
    team: Columns = {}
    for key, column in columns.items():
        if key in ("present", "active"):
            team[key] = column.copy()
        elif key == "collisions":
            team[key] = column.sum(axis=1)
        elif key == "is_success":
            team[key] = column[:, 0].copy()
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
    """Return the info of one team: Python numbers, and arrays over its cars."""
    return {
        key: column[env].item() if column.ndim == 1 else column[env] for key, column in team.items()
    }


def vector_infos(team: Columns, envs: Bool | None = None) -> dict[str, Any]:
    """Return the infos of a vector environment: each key with a mask of its environments.

    Args:
        team: Info values of all environments.
        envs: Mask of the selected environments, (env); the others have zeros. None selects all.
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
    """Return the mean of the finite values of each row, infinite if there are none, (env)."""
    known = np.isfinite(column)
    n = known.sum(axis=1)
    total = np.where(known, column, 0.0).sum(axis=1)
    mean: F64 = np.where(n > 0, total / np.maximum(n, 1), np.inf)
    return mean
