"""Progress of cars along the shortest paths to their slots, round the boxes of the room.

The progress is the decrease of a potential, so closed loops earn nothing [1]. Unlike in [1] the
potential is not discounted: with a discount gamma, a step also costs 1 - gamma times the path.

References:
    [1] Ng, Harada and Russell, Policy invariance under reward transformations, ICML (1999).
"""

from __future__ import annotations

import numpy as np

from relpos_env.tasks.kernels.path import follow_ways, lay_ways
from tracking.arrays import F64, I64, Bool


class Ways:
    """Shortest paths in a batch of rooms, from the boxes at the start of each episode."""

    def __init__(self, n_cars: int, n_envs: int, half_room: tuple[float, float]) -> None:
        """Allocate the arrays.

        Args:
            n_cars: Maximum number of cars.
            n_envs: Number of environments.
            half_room: Half width and half depth of the room [m].
        """
        self._half = half_room
        self._boxes: F64 = np.zeros((n_envs, 0, 6))
        self._n_corners: I64 = np.zeros(n_envs, dtype=np.int64)
        self._before: F64 = np.full((n_envs, n_cars, 2), np.nan)
        self._last: F64 = np.zeros((n_envs, n_cars))
        self._make_room(0)
        self.progress: F64 = np.zeros((n_envs, n_cars))
        """Decrease of each path length between the last two calls of `follow`, (env, car) [m]."""

    def lay(self, env: int, boxes: F64) -> None:
        """Compute the paths of one room and clear the goals of its cars.

        Args:
            env: Environment.
            boxes: Centre, half width and depth [m], cosine, sine, (box, 6).
        """
        if len(boxes) > self._boxes.shape[1]:
            self._make_room(len(boxes))
        self._boxes[env] = 0.0
        self._boxes[env, : len(boxes)] = boxes
        self._n_corners[env] = lay_ways(
            self._boxes[env], *self._half, self._corner[env], self._between[env]
        )
        self._before[env] = np.nan

    def follow(self, pos: F64, present: Bool, goal: F64, start: int, stop: int) -> None:
        """Write `progress` of the environments from start to stop.

        Progress is 0 for a new goal, and while no path leads to the goal; the first step with a
        path again includes the progress of the interval without.

        Args:
            pos: Positions, (env, car, 2) [m].
            present: True where the car is present, (env, car).
            goal: Goal positions, (env, car, 2) [m].
            start: First environment.
            stop: One past the last environment.
        """
        ways = (self._n_corners, self._corner, self._between)
        memory = (self._before, self._onward, self._last)
        follow_ways(start, stop, pos, present, goal, self._boxes, ways, memory, self.progress)

    def _make_room(self, n_boxes: int) -> None:
        """Enlarge the arrays for more boxes, keeping the paths of all rooms."""
        n_envs, n_cars = self._last.shape
        more, n = n_boxes - self._boxes.shape[1], 4 * n_boxes
        self._boxes = np.pad(self._boxes, ((0, 0), (0, more), (0, 0)))
        corner, between = np.zeros((n_envs, n, 2)), np.zeros((n_envs, n, n))
        onward = np.zeros((n_envs, n_cars, n))
        old = n - 4 * more
        if old > 0:
            corner[:, :old], between[:, :old, :old] = self._corner, self._between
            onward[..., :old] = self._onward
        self._corner: F64 = corner
        self._between: F64 = between
        self._onward: F64 = onward
