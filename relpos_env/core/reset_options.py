"""Options of `reset(options=...)` for an episode."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from relpos_env.config import Parts
from relpos_env.errors import EnvError
from relpos_env.scenarios import Scenario
from relpos_env.scenarios import scenario as find_scenario
from relpos_env.scenarios.episode import Episode
from relpos_env.scenarios.rooms.floor import spacing
from relpos_env.scenarios.rooms.obstacle import boxes_of
from relpos_env.scenarios.rooms.overlap import beyond_walls, car_boxes, overlap
from tracking.arrays import F64
from tracking.params.short_repr import short_repr

KNOWN = ("poses", "goals", "scenario")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ResetOptions:
    """Requests for one episode."""

    __repr__ = short_repr

    poses: F64 | None = None
    """x, y, heading of the first cars at the start, (car, 3) [m, m, rad]; drawn if None."""
    goals: F64 | None = None
    """Goal positions of the cars, (car, 2) [m], if the task is `hold`; the meeting point, (2) [m],
    if it is `rendezvous`; chosen by the task if None."""
    scenario: Scenario | None = None
    """Scenario in place of that of the environment, with the same room, protocol, antennas,
    magnetic waves and furnishing, and no more boxes."""

    def placed(self, episode: Episode, size: tuple[float, float]) -> Episode:
        """Return the episode with its first cars at the requested poses.

        Raises:
            EnvError: A car is in a wall, an obstacle or another car, or cars outnumber the slots.
        """
        if self.poses is None:
            return episode
        n = len(self.poses)
        if not 2 <= n <= len(episode.start):
            raise EnvError(f"poses: expected 2 to {len(episode.start)} cars, got {n}")
        taken = car_boxes(self.poses, episode.car, 0.0)
        apart = np.linalg.norm(self.poses[:, None, :2] - self.poses[None, :, :2], axis=-1)
        near = np.argwhere(
            np.triu(apart < spacing(episode.car), 1) & np.triu(overlap(taken, taken), 1)
        )
        if len(near):
            raise EnvError(f"poses: cars {near[0][0]} and {near[0][1]} overlap")
        hit = overlap(taken, boxes_of(episode.obstacles)).any(axis=1) | beyond_walls(taken, size)
        if hit.any():
            raise EnvError(f"poses: car {int(hit.argmax())} is in a wall or an obstacle")
        start = np.zeros_like(episode.start)
        start[:n] = self.poses
        return replace(episode, start=start, present=np.arange(len(start)) < n)


def reset_options(options: Mapping[str, Any] | None, parts: Parts) -> ResetOptions:
    """Read the options of a reset.

    Args:
        options: Options by name; None for no options.
        parts: Resolved configuration of the environment.

    Raises:
        EnvError: An option is unknown or has a wrong shape.
    """
    options = checked_options(options)
    for name in options:
        if name not in KNOWN:
            raise EnvError(f"options: expected names among {', '.join(KNOWN)}, got {name!r}")
    poses, goals = options.get("poses"), options.get("goals")
    requested = options.get("scenario")
    if not isinstance(requested, str | Path | Scenario | None):
        raise EnvError(
            f"options: scenario: expected a name, a path or a scenario, got {requested!r}"
        )
    return ResetOptions(
        poses=None if poses is None else _rows("poses", poses, 3),
        goals=None if goals is None else _rows("goals", goals, 2),
        scenario=None if requested is None else _fitting(find_scenario(requested), parts),
    )


def checked_options(options: Any) -> Mapping[str, Any]:
    """Return options of a reset, none for None.

    Raises:
        EnvError: They are not a mapping.
    """
    if options is not None and not isinstance(options, Mapping):
        raise EnvError(f"options: expected a dict, got {options!r}")
    return options or {}


def _rows(name: str, value: Any, columns: int) -> F64:
    """Return a value as finite numbers, (row, columns); (columns) becomes one row.

    Raises:
        EnvError: The value has another shape or is not finite.
    """
    try:
        array = np.atleast_2d(np.asarray(value, dtype=np.float64))
    except (TypeError, ValueError):
        array = np.zeros(0)
    if array.ndim != 2 or array.shape[1] != columns or not np.isfinite(array).all():
        raise EnvError(f"{name}: expected finite numbers, (car, {columns}), got {value!r}")
    return array


def _fitting(requested: Scenario, parts: Parts) -> Scenario:
    """Return the scenario, if it fits an environment that was made for another one.

    Raises:
        EnvError: The scenario does not fit.
    """
    made = parts.scenario
    if requested.room != made.room:
        raise EnvError(f"scenario: expected a room of {made.room} m, got {requested.room}")
    if requested.max_boxes > max(made.max_boxes, 1):
        raise EnvError(
            f"scenario: expected at most {made.max_boxes} obstacles, got {requested.max_boxes}"
        )
    if requested.radio.session != made.radio.session:
        raise EnvError("scenario: expected the radio protocol of the environment, got another")
    for name, ours, theirs in (
        ("height of the antennas", made.radio.antenna_height, requested.radio.antenna_height),
        ("number of magnetic waves", made.mag.n_waves, requested.mag.n_waves),
        ("furnish", made.furnish, requested.furnish),
    ):
        if ours != theirs:
            raise EnvError(f"scenario: expected the {name} of the environment, got another")
    return requested.with_cars(min(parts.n_cars, requested.n_cars_range[1]))
