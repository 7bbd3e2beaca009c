"""What a task is: wanted relative positions and velocities over time, reward terms, an end.

All environments of a batch do the same task, each with cars of its own; a task says how a car
gets a place (`begin`, `change`, rare, numpy) and how things follow from the time (`compute`,
every step, one compiled call). What has to be known of the step before is done in `update`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from types import MappingProxyType
from typing import Protocol

import numpy as np

from relpos_env.errors import EnvError
from relpos_env.tasks.options import car_count
from tracking.arrays import F64, I64, Bool

COMMON_TERMS = ("collision", "effort", "nearness")
"""Reward terms of every task after its first two, `formation` and one of its own."""

NO_BOXES: F64 = np.zeros((0, 6))


class Truth(Protocol):
    """What a task reads of the world, arrays over (env, car)."""

    @property
    def pos_w(self) -> F64:
        """Position, (env, car, 2) [m]."""

    @property
    def vel_w(self) -> F64:
        """Velocity, (env, car, 2) [m/s]."""

    @property
    def accel_w(self) -> F64:
        """Acceleration, (env, car, 2) [m/s2]."""

    @property
    def clearance(self) -> F64:
        """Distance to what is nearest to the car's body, (env, car) [m]; infinite if not known."""

    @property
    def present(self) -> Bool:
        """True while the car is in the room, (env, car)."""


class Task(ABC):
    """What is asked of the cars of a batch of rooms. Absent cars have zeros everywhere.

    Law: an environment of a batch has the same numbers as alone, bit for bit.
    """

    default_weights: Mapping[str, float] = MappingProxyType({})
    """Weights of reward terms that are not 1; tasks of ours have theirs in `DEFAULT_WEIGHTS`."""

    def __init__(self, n_cars: int, n_envs: int, terms: tuple[str, ...]) -> None:
        """Make the arrays.

        Args:
            n_cars: Slots for cars, 2 to 20.
            n_envs: Environments.
            terms: Names of the reward terms.

        Raises:
            EnvError: A number out of range.
        """
        car_count(n_cars)
        if n_envs < 1:
            raise EnvError(f"n_envs: expected at least 1, got {n_envs}")
        self.n_cars, self.n_envs, self.terms = n_cars, n_envs, terms
        self.target: F64 = np.zeros((n_envs, n_cars, n_cars, 2))
        """Wanted position of each other car relative to each car, (env, car, other, 2) [m]."""
        self.has_target: Bool = np.zeros((n_envs, n_cars, n_cars), dtype=bool)
        """False where the task gives no place, (env, car, other)."""
        self.plan: F64 = np.zeros((n_envs, n_cars, 2))
        """Velocity that the plan wants; of time alone, never of the truth, (env, car, 2) [m/s]."""
        self.goal_w: F64 = np.zeros((n_envs, n_cars, 2))
        """Where in the room the plan wants the car; not for policies, (env, car, 2) [m]."""
        self.error: F64 = np.zeros((n_envs, n_cars))
        """Distance of the present others from their places, mean, (env, car) [m]."""
        self.rewards: F64 = np.zeros((n_envs, n_cars, len(terms)))
        """(env, car, term) [-]"""
        self.done: Bool = np.zeros(n_envs, dtype=bool)
        """True where the task is accomplished, (env)."""
        self._seated: Bool = np.zeros((n_envs, n_cars), dtype=bool)
        self._boxes: list[F64] = [NO_BOXES] * n_envs
        """What stood in each room at the start."""

    def reset(self, state: Truth, envs: slice, boxes: F64 | None = None) -> None:
        """Begin an episode from where the cars stand; `update` with t = 0 then fills the arrays.

        Args:
            state: The truth, of all environments.
            envs: Which begin, contiguous.
            boxes: What stands in the rooms: centre, half width and depth [m], cosine, sine,
                (env, box, 6), of all environments; None where they are not known.
        """
        start, stop = self._range(envs)
        for env in range(start, stop):
            self._boxes[env] = NO_BOXES if boxes is None else boxes[env].copy()
            present = state.present[env]
            self._seat(env, present)
            if present.any():
                self.begin(env, state.pos_w[env], np.flatnonzero(present))
            else:
                self.begin(env, np.zeros((self.n_cars, 2)), np.arange(self.n_cars))

    def update(self, state: Truth, t: F64, collided: F64, envs: slice) -> None:
        """Write all arrays for now; where cars came or went, give out new places before.

        Args:
            state: The truth, of all environments.
            t: Since the start of the episode, (env) [s].
            collided: Contacts begun in the step, (env, car).
            envs: Which to update, contiguous.
        """
        start, stop = self._range(envs)
        if not self.compute(state, t, collided, start, stop):
            return
        for env in range(start, stop):
            present = state.present[env]
            if not np.array_equal(present, self._seated[env]):
                before = self._seated[env].copy()
                self._seat(env, present)
                if present.any():
                    cars = np.flatnonzero(present)
                    self.change(env, state.pos_w[env], cars, before, float(t[env]))
        self.compute(state, t, collided, start, stop)

    def set_goals(self, env: int, goals: F64, cars: I64) -> None:
        """Let the cars of an episode that has just begun go where they are wanted.

        Args:
            env: Environment.
            goals: In the room, (car, 2) [m], or (1, 2) for all.
            cars: Indices of those that are present.

        Raises:
            EnvError: The task takes none, or not these.
        """
        raise EnvError("goals: expected none, the task has places of its own")

    @abstractmethod
    def begin(self, env: int, pos: F64, cars: I64) -> None:
        """Give out places at the start of an episode.

        Args:
            env: Environment.
            pos: Where all cars stand, (car, 2) [m].
            cars: Indices of those that are present, or of all if none is.
        """

    @abstractmethod
    def change(self, env: int, pos: F64, cars: I64, before: Bool, t: float) -> None:
        """Give out places again, since cars came or went.

        Args:
            env: Environment.
            pos: Where all cars stand, (car, 2) [m].
            cars: Indices of those that are present, at least one.
            before: Who was, (car).
            t: Since the start of the episode [s].
        """

    @abstractmethod
    def compute(self, state: Truth, t: F64, collided: F64, start: int, stop: int) -> int:
        """Write all arrays of environments whose cars have places; return how many have not."""

    def _seat(self, env: int, present: Bool) -> None:
        """Note who is in the room; tasks without places overwrite `has_target` with False."""
        self._seated[env] = present
        both = present[:, None] & present[None, :]
        np.fill_diagonal(both, False)
        self.has_target[env] = both

    def _range(self, envs: slice) -> tuple[int, int]:
        start, stop, step = envs.indices(self.n_envs)
        if step != 1:
            raise EnvError(f"envs: expected a contiguous slice, got {envs}")
        return start, stop
