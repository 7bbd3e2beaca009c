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

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracking.arrays import F64, I64, Bool

Columns = dict[str, NDArray[Any]]
"""By key, arrays over (env, car) or (env)."""


class Figures(NamedTuple):
    """Of cars, arrays over (env, car)."""

    formation_error: F64
    tracking_error: F64
    tracked: I64
    collisions: I64
    is_success: Bool
    parts: F64
    """Of the reward, (env, car, term)."""


def make_figures(n_envs: int, n_cars: int, n_terms: int) -> Figures:
    """Room for them."""
    shape = n_envs, n_cars
    return Figures(
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
    """The figures of cars by their keys; they share memory.

    Args:
        figures: As `write_figures` leaves them.
        terms: Of the task.
        present: (env, car)
        active: (env, car)
        counted: Whether anybody counts collisions.
    """
    columns: Columns = {
        "formation_error": figures.formation_error,
        "tracking_error": figures.tracking_error,
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
