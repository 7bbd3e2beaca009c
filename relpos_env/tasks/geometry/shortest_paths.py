"""How far cars come along the shortest ways to their places, round what stands in the room.

What a car gains by coming nearer it loses by going away again: it is the change of a potential, by
which nothing is to be had in circles [1]. It is not discounted, as that theorem asks. To a learner
who discounts by gamma it is a price of 1 - gamma times the way in every step, besides.

References:
    [1] Ng, Harada and Russell, Policy invariance under reward transformations, ICML (1999).
"""

from __future__ import annotations

import numpy as np

from relpos_env.tasks.kernels.path import follow_ways, lay_ways
from tracking.arrays import F64, I64, Bool


class Ways:
    """Ways in the rooms of a batch, as they are at the beginning of each episode."""

    def __init__(self, n_cars: int, n_envs: int, half_room: tuple[float, float]) -> None:
        """Make the arrays.

        Args:
            n_cars: Slots for cars.
            n_envs: Environments.
            half_room: Half the width and depth of the room [m].
        """
        self._half = half_room
        self._boxes: F64 = np.zeros((n_envs, 0, 6))
        self._n_corners: I64 = np.zeros(n_envs, dtype=np.int64)
        self._before: F64 = np.full((n_envs, n_cars, 2), np.nan)
        self._last: F64 = np.zeros((n_envs, n_cars))
        self._make_room(0)
        self.progress: F64 = np.zeros((n_envs, n_cars))
        """How much nearer each car came between the last two calls of `follow`, (env, car) [m]."""

    def lay(self, env: int, boxes: F64) -> None:
        """Find the ways in one room, in which no car has a goal yet.

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

        It is 0 where the goal is another than before, and where no way leads to it; where there is
        none for a while, what came of that while comes after it.

        Args:
            pos: (env, car, 2) [m].
            present: (env, car).
            goal: (env, car, 2) [m].
            start: First environment.
            stop: One behind the last.
        """
        ways = (self._n_corners, self._corner, self._between)
        memory = (self._before, self._onward, self._last)
        follow_ways(start, stop, pos, present, goal, self._boxes, ways, memory, self.progress)

    def _make_room(self, n_boxes: int) -> None:
        """For so many boxes; what is known of other rooms stays."""
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
