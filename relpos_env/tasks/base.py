"""Base class of tasks: relative targets and reference velocities over time, reward terms, an end.

All environments of a batch have the same task, each with its own cars. A task assigns slots to
cars (`begin`, `change`: rare, numpy) and computes its arrays from the time (`compute`: every
step, one compiled call). Quantities that depend on the previous step are computed in `update`.
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
"""Reward terms of every task after its first two, `formation` and a task-specific term."""

NO_BOXES: F64 = np.zeros((0, 6))


class Truth(Protocol):
    """State of the world as read by tasks, arrays over (env, car)."""

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
        """Distance from the car's body to the nearest object, (env, car) [m]; inf if unknown."""

    @property
    def present(self) -> Bool:
        """True while the car is in the room, (env, car)."""


class Pose(Truth, Protocol):
    """State of the world as read by tasks that drive a car."""

    @property
    def heading(self) -> F64:
        """Heading, (env, car) [rad]."""


class Task(ABC):
    """Targets, rewards and end of a batch of environments. Arrays are 0 for absent cars.

    Invariant: the results of an environment do not depend on the batch, bit for bit.
    """

    default_weights: Mapping[str, float] = MappingProxyType({})
    """Weights of reward terms that are not 1; those of built-in tasks are `DEFAULT_WEIGHTS`."""

    def __init__(self, n_cars: int, n_envs: int, terms: tuple[str, ...]) -> None:
        """Allocate the arrays.

        Args:
            n_cars: Maximum number of cars, 2 to 20.
            n_envs: Number of environments.
            terms: Names of the reward terms.

        Raises:
            EnvError: A number out of range.
        """
        car_count(n_cars)
        if n_envs < 1:
            raise EnvError(f"n_envs: expected at least 1, got {n_envs}")
        self.n_cars, self.n_envs, self.terms = n_cars, n_envs, terms
        self.target: F64 = np.zeros((n_envs, n_cars, n_cars, 2))
        """Target position of each other car relative to each car, (env, car, other, 2) [m]."""
        self.has_target: Bool = np.zeros((n_envs, n_cars, n_cars), dtype=bool)
        """False where the task sets no target, (env, car, other)."""
        self.plan: F64 = np.zeros((n_envs, n_cars, 2))
        """Reference velocity, independent of the true state, (env, car, 2) [m/s]."""
        self.goal_w: F64 = np.zeros((n_envs, n_cars, 2))
        """Goal position in the room; not for policies, (env, car, 2) [m]."""
        self.error: F64 = np.zeros((n_envs, n_cars))
        """Mean distance of the other present cars from their targets, (env, car) [m]."""
        self.rewards: F64 = np.zeros((n_envs, n_cars, len(terms)))
        """Reward terms, unweighted, (env, car, term) [-]."""
        self.done: Bool = np.zeros(n_envs, dtype=bool)
        """True where the task is done, (env)."""
        self._assigned: Bool = np.zeros((n_envs, n_cars), dtype=bool)
        self._boxes: list[F64] = [NO_BOXES] * n_envs
        """Boxes in each room at the start of the episode."""

    def reset(self, state: Truth, envs: slice, boxes: F64 | None = None) -> None:
        """Begin an episode at the cars' positions; `update` with t = 0 then fills the arrays.

        Args:
            state: True state of all environments.
            envs: Environments to reset, contiguous.
            boxes: Boxes in the rooms: centre, half width and depth [m], cosine, sine,
                (env, box, 6), of all environments; None if they are unknown.
        """
        start, stop = self._range(envs)
        for env in range(start, stop):
            self._boxes[env] = NO_BOXES if boxes is None else boxes[env].copy()
            present = state.present[env]
            self._assign(env, present)
            if present.any():
                self.begin(env, state.pos_w[env], np.flatnonzero(present))
            else:
                self.begin(env, np.zeros((self.n_cars, 2)), np.arange(self.n_cars))

    def update(self, state: Truth, t: F64, collided: F64, envs: slice) -> None:
        """Write all arrays for time t, after new assignments where cars joined or left.

        Args:
            state: True state of all environments.
            t: Time since the start of the episode, (env) [s].
            collided: Number of contacts begun in the step, (env, car).
            envs: Environments to update, contiguous.
        """
        start, stop = self._range(envs)
        if not self.compute(state, t, collided, start, stop):
            return
        for env in range(start, stop):
            present = state.present[env]
            if not np.array_equal(present, self._assigned[env]):
                before = self._assigned[env].copy()
                self._assign(env, present)
                if present.any():
                    cars = np.flatnonzero(present)
                    self.change(env, state.pos_w[env], cars, before, float(t[env]))
        self.compute(state, t, collided, start, stop)

    def set_goals(self, env: int, goals: F64, cars: I64) -> None:
        """Set goal positions at the start of an episode.

        Args:
            env: Environment.
            goals: Goal positions in the room, (car, 2) [m], or (1, 2) for all.
            cars: Indices of the present cars.

        Raises:
            EnvError: The task accepts no goals, or these are invalid.
        """
        raise EnvError("goals: expected none, the task has places of its own")

    @abstractmethod
    def begin(self, env: int, pos: F64, cars: I64) -> None:
        """Assign slots at the start of an episode.

        Args:
            env: Environment.
            pos: Positions of all cars, (car, 2) [m].
            cars: Indices of the present cars, or of all if none is present.
        """

    @abstractmethod
    def change(self, env: int, pos: F64, cars: I64, before: Bool, t: float) -> None:
        """Assign slots again after cars joined or left.

        Args:
            env: Environment.
            pos: Positions of all cars, (car, 2) [m].
            cars: Indices of the present cars, at least one.
            before: True for cars that were present at the last assignment, (car).
            t: Time since the start of the episode [s].
        """

    @abstractmethod
    def compute(self, state: Truth, t: F64, collided: F64, start: int, stop: int) -> int:
        """Write the arrays of environments with valid assignments; return the number of others."""

    def _assign(self, env: int, present: Bool) -> None:
        """Record the present cars; tasks without targets overwrite `has_target` with False."""
        self._assigned[env] = present
        both = present[:, None] & present[None, :]
        np.fill_diagonal(both, False)
        self.has_target[env] = both

    def _range(self, envs: slice) -> tuple[int, int]:
        start, stop, step = envs.indices(self.n_envs)
        if step != 1:
            raise EnvError(f"envs: expected a contiguous slice, got {envs}")
        return start, stop


class DrivingTask(Task):
    """A task that drives a car itself; its rooms have no operator."""

    has_samples: Bool | bool = True
    """False for cars without inertial sensors and magnetometer, (car), or one value for all."""

    @abstractmethod
    def plan_drive(self, env: int, rng: np.random.Generator) -> None:
        """Draw the drive of an episode."""

    @abstractmethod
    def drive(self, state: Pose, t: F64, speed: F64, steering: F64) -> None:
        """Replace the commands of the cars that the task drives.

        Args:
            state: True state of all environments.
            t: Time since the start of the episode, (env) [s].
            speed: Commanded speeds, (env, car) [m/s], updated.
            steering: Commanded steering angles, (env, car) [rad], updated.
        """


class InformedTask(Task):
    """A task with rewards that depend on the estimates of the cars."""

    @abstractmethod
    def inform(self, cov: F64, ok: Bool, envs: slice) -> None:
        """Write these reward terms.

        Args:
            cov: Covariances xx, yy, xy of relative positions, (env, car, other, 3) [m2].
            ok: True for usable estimates, (env, car, other).
            envs: Environments to update, contiguous.
        """
