"""Task `escort`: keep a formation round a car that drives as it likes."""

from __future__ import annotations

import numpy as np

from relpos_env.errors import EnvError
from relpos_env.tasks.base import COMMON_TERMS, DrivingTask, Pose, Truth
from relpos_env.tasks.geometry.assignment import assign
from relpos_env.tasks.geometry.shapes import MAX_SPACING, MIN_SPACING
from relpos_env.tasks.kernels.escort import update_escort, wander
from relpos_env.tasks.moving import ERROR_SCALE, MARGIN
from relpos_env.tasks.options import half_room, positive
from tracking.arrays import F64, I64, Bool

N_WAYPOINTS = 32
"""[-] Waypoints of an episode."""
LONGEST_REST = 2.0
"""[s] Longest rest at a waypoint."""
NEAR, LONGEST = 0.5, 12.0
"""[m], [s] Distance at which a waypoint is reached, and time after which it is given up."""
GAIN, MOST_STEERING = 1.5, 0.4
"""[-], [rad] Steering per heading error, and its limit."""


class Escort(DrivingTask):
    """Slots round the first present car, which drives to random waypoints by itself.

    Its actions have no effect. The frame does not turn, so targets are constant, and no reference
    velocity says where the escorted car will drive.
    """

    def __init__(
        self,
        n_cars: int,
        n_envs: int,
        room: tuple[float, float],
        *,
        spacing: float | None = None,
        speed: float = 0.5,
    ) -> None:
        """Check the options.

        Args:
            n_cars: Maximum number of cars, 2 to 20.
            n_envs: Number of environments.
            room: Width along x and depth along y [m].
            spacing: Distance between neighbours on the ring [m]; by default 1 m, or less in small
                rooms.
            speed: Speed of the escorted car [m/s].

        Raises:
            EnvError: An option is out of range, or the formation does not fit in the room.
        """
        super().__init__(n_cars, n_envs, ("formation", "velocity", *COMMON_TERMS))
        half = half_room(room, MARGIN)
        # The ring may take half of the room; the rest is for the escorted car.
        most = 0.5 * float(half.min()) / _radius(n_cars - 1)
        self._spacing = min(MAX_SPACING, most) if spacing is None else positive("spacing", spacing)
        if self._spacing > most or self._spacing < MIN_SPACING:
            raise EnvError(
                f"spacing: expected {MIN_SPACING:g} to {most:.2f} m for {n_cars} cars in this "
                f"room, got {self._spacing:.2f}"
            )
        self._free = half - self._spacing * _radius(n_cars - 1)
        self._limits = (positive("speed", speed), NEAR, LONGEST, GAIN, MOST_STEERING)
        self._escorted: I64 = np.zeros(n_envs, dtype=np.int64)
        self._places: F64 = np.zeros((n_envs, n_cars, 2))
        self._waypoints: F64 = np.zeros((n_envs, N_WAYPOINTS, 3))
        self._now: F64 = np.zeros((n_envs, 2))

    def plan_drive(self, env: int, rng: np.random.Generator) -> None:
        """Draw the waypoints of the escorted car, and its rest at each."""
        high = np.array([*self._free, LONGEST_REST])
        self._waypoints[env] = rng.uniform([*-self._free, 0.0], high, (N_WAYPOINTS, 3))
        self._now[env] = 0.0

    def drive(self, state: Pose, t: F64, speed: F64, steering: F64) -> None:
        """Write the commands of the escorted cars."""
        wander(
            state.pos_w, state.heading, self._escorted, t, self._waypoints, self._now,
            self._limits, speed, steering,
        )  # fmt: skip

    def begin(self, env: int, pos: F64, cars: I64) -> None:
        """Assign slots; the first present car is escorted."""
        self._escorted[env] = cars[0]
        self._places[env] = 0.0
        others = cars[1:]
        if len(others):
            angle = np.pi + 2.0 * np.pi * np.arange(len(others)) / len(others)
            slots = np.stack([np.cos(angle), np.sin(angle)], axis=1)
            slots *= self._spacing * _radius(len(others))
            self._places[env, others] = slots[assign(pos[others] - pos[cars[0]], slots)]

    def change(self, env: int, pos: F64, cars: I64, before: Bool, t: float) -> None:
        """Assign slots to the present cars."""
        self.begin(env, pos, cars)

    def compute(self, state: Truth, t: F64, collided: F64, start: int, stop: int) -> int:
        """Run `update_escort`."""
        n_changed: int = update_escort(
            start, stop, state.pos_w, state.vel_w, state.accel_w, state.clearance, state.present,
            collided, self._assigned, self._escorted, self._places, ERROR_SCALE, self.target,
            self.goal_w, self.error, self.rewards,
        )  # fmt: skip
        return n_changed


def _radius(n: int) -> float:
    """Return the radius of a ring of n cars over the distance of its neighbours, at least 1."""
    return max(1.0, 0.5 / np.sin(np.pi / n)) if n > 1 else 1.0
