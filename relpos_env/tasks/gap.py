"""Task `gap`: pass a gap in a wall in single file and form up behind it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import linear_sum_assignment

from relpos_env.errors import EnvError
from relpos_env.scenarios.rooms.gap import Gap as Opening
from relpos_env.tasks.base import COMMON_TERMS, Task, Truth
from relpos_env.tasks.geometry.assignment import assign
from relpos_env.tasks.geometry.shapes import Formation
from relpos_env.tasks.kernels.gap import update_gap
from relpos_env.tasks.moving import ERROR_SCALE, MARGIN, TOLERANCE
from relpos_env.tasks.options import half_room, points, positive
from tracking.arrays import F64, I64, Bool

APPROACH = 0.6
"""[m] Distance from the wall to the waypoints before and behind the gap: straight passage."""


class Gap(Task):
    """Cars drive along waypoints in single file from their initial positions to a formation.

    The car nearest to the first waypoint leaves first and gets the slot furthest from the last
    waypoint before the formation. Cars behind the wall drive to their slots at once.
    """

    def __init__(
        self,
        n_cars: int,
        n_envs: int,
        room: tuple[float, float],
        *,
        gap: Opening | None = None,
        waypoints: Sequence[Sequence[float]] | F64 | None = None,
        shape: str | Sequence[Sequence[float]] | F64 = "triangle",
        spacing: float | None = None,
        speed: float = 0.6,
        headway: float = 1.0,
    ) -> None:
        """Plan the path.

        Args:
            n_cars: Maximum number of cars, 2 to 20.
            n_envs: Number of environments.
            room: Width along x and depth along y [m].
            gap: Gap that is passed along x; environments pass the gap of their scenario. By
                default 1 m wide, in the middle.
            waypoints: Points from before the wall (smaller x) through the gap and round
                obstacles to the middle of the final formation [m]; by default straight through
                the gap to the middle of the room behind.
            shape: Final formation, one of `SHAPES`, or slots (x ahead, y left) [m], one per car.
            spacing: Final distance between neighbours [m]; by default 1 m, or less in small
                rooms.
            speed: Speed along the path [m/s].
            headway: Distance between successive cars along the path [m].

        Raises:
            EnvError: An option is out of range, or the formation does not fit in the room.
        """
        super().__init__(n_cars, n_envs, ("formation", "progress", *COMMON_TERMS, "time"))
        gap = Opening(width=1.0) if gap is None else gap
        if not isinstance(gap, Opening):
            raise EnvError(f"gap: expected a relpos_env.scenarios.Gap, got {gap!r}")
        if abs(gap.direction) > 1e-6:
            raise EnvError(f"gap: expected one that is passed along x, got {gap.direction:g} rad")
        self._wall_x = gap.x
        half = half_room(room, 0.0)
        behind = gap.x + 0.5 * gap.thickness
        if waypoints is None:
            x, y = gap.x, gap.y
            middle = (0.5 * (behind + half[0]), 0.0)
            self._way: F64 = np.array([(x - APPROACH, y), (x + APPROACH, y), middle])
        else:
            self._way = points("waypoints", waypoints, 2)
            before = gap.x - 0.5 * gap.thickness - MARGIN
            inside = np.all(np.abs(self._way) <= half - MARGIN)
            if not inside or self._way[0, 0] > before or self._way[-1, 0] < behind + MARGIN:
                raise EnvError(
                    "waypoints: expected points in the room, the first one before the wall and "
                    f"the last one behind it, at least {MARGIN} m from walls"
                )
        end = self._way[-1]
        free = np.array([min(half[0] - end[0], end[0] - behind), half[1] - abs(end[1])]) - MARGIN
        self._formation = Formation(shape, n_cars, spacing)
        self._formation.fit(free, 0.0)
        self._headway = positive("headway", headway)
        self._limits = (positive("speed", speed), TOLERANCE, ERROR_SCALE)
        self._route = np.zeros((n_envs, n_cars, len(self._way) + 1, 3))
        self._lag = np.zeros((n_envs, n_cars))

    def begin(self, env: int, pos: F64, cars: I64) -> None:
        """Start cars by distance from the gap, one per headway; those behind the wall at once."""
        queue = self._queue(pos, cars)
        self._lag[env] = 0.0
        self._lag[env, queue] = self._headway * np.arange(len(queue))
        places = self._way[-1] + self._formation.places(len(cars))
        across = cars[~np.isin(cars, queue)]
        for_across, for_queue = self._share(pos[across], places)
        self._lay(env, pos, across, for_across, self._way[:0])
        far_first = np.argsort(-np.linalg.norm(for_queue - self._way[-2], axis=1), kind="stable")
        self._lay(env, pos, queue, for_queue[far_first], self._way[:-1])

    def change(self, env: int, pos: F64, cars: I64, before: Bool, t: float) -> None:
        """Queue new cars behind the last; the paths of the others change at their end only."""
        travelled = self._limits[0] * t
        stay, new = cars[before[cars]], cars[~before[cars]]
        # New cars count as if they were at the arrival point, so the others keep their slots.
        ends = np.concatenate(
            [self._route[env, stay, -1, :2], np.tile(self._way[-2], (len(new), 1))]
        )
        places = self._way[-1] + self._formation.places(len(cars))
        places = places[assign(ends, places)]
        queue = self._queue(pos, new)
        across = new[~np.isin(new, queue)]
        last = max(self._lag[env, stay].max(initial=-np.inf) + self._headway, travelled)
        self._lag[env, queue] = last + self._headway * np.arange(len(queue))
        self._lag[env, across] = travelled
        order = np.concatenate([stay, new])
        place_of = {int(car): places[k] for k, car in enumerate(order)}
        for car in stay:
            self._end_at(env, car, place_of[int(car)])
        for group, way in ((queue, self._way[:-1]), (across, self._way[:0])):
            given = np.array([place_of[int(car)] for car in group]).reshape(-1, 2)
            self._lay(env, pos, group, given, way)

    def compute(self, state: Truth, t: F64, collided: F64, start: int, stop: int) -> int:
        """Run `update_gap`."""
        n_changed: int = update_gap(
            start,
            stop,
            state.pos_w,
            state.accel_w,
            state.clearance,
            state.present,
            t,
            collided,
            self._assigned,
            self._route,
            self._lag,
            self._limits,
            self.target,
            self.plan,
            self.goal_w,
            self.error,
            self.rewards,
            self.done,
        )
        return n_changed

    def _queue(self, pos: F64, cars: I64) -> I64:
        """Return the cars before the wall by distance from the first waypoint."""
        queue = cars[pos[cars, 0] < self._wall_x]
        away = np.linalg.norm(pos[queue] - self._way[0], axis=1)
        found: I64 = queue[np.argsort(away, kind="stable")]
        return found

    def _share(self, pos: F64, places: F64) -> tuple[F64, F64]:
        """Return slots for cars behind the wall (least sum of squared distances), and the rest."""
        taken: list[int] = []
        if len(pos):
            cost = np.sum((pos[:, None] - places[None, :]) ** 2, axis=-1)
            taken = list(linear_sum_assignment(cost)[1])
        rest = [k for k in range(len(places)) if k not in taken]
        return places[taken], places[rest]

    def _lay(self, env: int, pos: F64, cars: I64, places: F64, way: F64) -> None:
        """Write the routes of cars from their positions along a path to their slots."""
        n = self._route.shape[2]
        for car, place in zip(cars, places, strict=True):
            route = np.concatenate([pos[car][None], way, np.tile(place, (n - 1 - len(way), 1))])
            segments = np.linalg.norm(np.diff(route, axis=0), axis=1)
            self._route[env, car, :, :2] = route
            self._route[env, car, 1:, 2] = np.cumsum(segments)

    def _end_at(self, env: int, car: int, place: F64) -> None:
        """Replace the end of a car's route."""
        route = self._route[env, car]
        # The route of a car that joined behind the wall is one segment, its end repeated.
        last = np.flatnonzero(route[1:, 2] > route[:-1, 2])
        segment = int(last[-1]) if len(last) else 0
        route[segment + 1 :, :2] = place
        route[segment + 1 :, 2] = route[segment, 2] + np.linalg.norm(place - route[segment, :2])
