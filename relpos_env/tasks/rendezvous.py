"""Task `rendezvous`: meet, without relative targets."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from relpos_env.errors import EnvError
from relpos_env.tasks.base import COMMON_TERMS, Task, Truth
from relpos_env.tasks.kernels.rendezvous import update_meeting
from relpos_env.tasks.moving import ERROR_SCALE, MARGIN
from relpos_env.tasks.options import half_room, not_negative, points, positive
from tracking.arrays import F64, I64, Bool

ROOM_OF_CAR = 0.35
"""[m] Radius of a disc that holds n cars, divided by the square root of n."""


class Rendezvous(Task):
    """All cars drive to within a radius of the group's mean position and stay there.

    There are no targets and no reference velocities: the cars meet by their own estimates. An
    operator can only bring the group as a whole to the meeting point.
    """

    def __init__(
        self,
        n_cars: int,
        n_envs: int,
        room: tuple[float, float],
        *,
        radius: float | None = None,
        stay: float = 2.0,
        place: Sequence[float] | None = None,
    ) -> None:
        """Check the options.

        Args:
            n_cars: Maximum number of cars, 2 to 20.
            n_envs: Number of environments.
            room: Width along x and depth along y [m].
            radius: Radius within which all cars must be [m]; by default `ROOM_OF_CAR` times the
                square root of the number of cars.
            stay: Time for which all cars must stay within the radius [s].
            place: Meeting point in the room [m]; by default the group's mean position at the
                start, or as near to it as the radius allows.

        Raises:
            EnvError: An option is out of range, or the radius does not fit in the room.
        """
        super().__init__(n_cars, n_envs, ("formation", "progress", *COMMON_TERMS, "time"))
        r = ROOM_OF_CAR * np.sqrt(n_cars) if radius is None else positive("radius", radius)
        self._half = half_room(room, MARGIN)
        if r > self._half.min():
            raise EnvError(f"radius: expected at most {self._half.min():.2f} m, got {r:.2f}")
        self._fixed = None if place is None else points("place", [place], 1)[0]
        if self._fixed is not None and np.any(np.abs(self._fixed) > self._half):
            raise EnvError(f"place: expected a point in the room, got {place!r}")
        self._limits = (float(r), not_negative("stay", stay), ERROR_SCALE)
        self._room = self._half - r
        self._place, self._since = np.zeros((n_envs, 2)), np.full(n_envs, np.inf)

    def begin(self, env: int, pos: F64, cars: I64) -> None:
        """Choose the meeting point."""
        middle = np.clip(pos[cars].mean(axis=0), -self._room, self._room)
        self._place[env] = middle if self._fixed is None else self._fixed
        self._since[env] = np.inf

    def set_goals(self, env: int, goals: F64, cars: I64) -> None:
        """Set the meeting point."""
        if len(goals) != 1 or np.any(np.abs(goals[0]) > self._half):
            raise EnvError(f"goals: expected one point in the room, got {goals.tolist()}")
        self._place[env] = goals[0]

    def change(self, env: int, pos: F64, cars: I64, before: Bool, t: float) -> None:
        """Restart the time within the radius; the meeting point stays the same."""
        self._since[env] = np.inf

    def compute(self, state: Truth, t: F64, collided: F64, start: int, stop: int) -> int:
        """Run `update_meeting`."""
        n_changed: int = update_meeting(
            start,
            stop,
            state.pos_w,
            state.vel_w,
            state.accel_w,
            state.clearance,
            state.present,
            t,
            collided,
            self._assigned,
            self._place,
            self._since,
            self._limits,
            self.goal_w,
            self.error,
            self.rewards,
            self.done,
        )
        return n_changed

    def _assign(self, env: int, present: Bool) -> None:
        super()._assign(env, present)
        self.has_target[env] = False
