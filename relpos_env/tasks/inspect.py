"""Task `inspect`: see every wall of the room and of the boxes in it.

Cars drive along the walls, evenly spaced, so that each sees a part. A car that does not know where
it is relative to the others cannot say what it sees, so nothing that it sees counts.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from relpos_env.tasks.base import InformedTask, Truth
from relpos_env.tasks.kernels.inspect import see_walls
from relpos_env.tasks.options import half_room, positive, share
from relpos_env.tasks.ring import Ring
from tracking.arrays import F64, I64, Bool

STEP = 0.25
"""[m] Distance between two points of a wall."""
MARGIN = 0.9
"""[m] Distance from the walls at which cars drive by default."""


class Inspect(InformedTask, Ring):
    """Slots that move along the walls, and the share of the walls that has been seen."""

    _more_terms = ("time", "coverage")

    def __init__(
        self,
        n_cars: int,
        n_envs: int,
        room: tuple[float, float],
        *,
        half_axes: Sequence[float] | None = None,
        speed: float = 0.7,
        lookahead: float = 0.3,
        reach: float = 2.0,
        enough: float = 0.95,
    ) -> None:
        """Build the loop.

        Args:
            n_cars: Maximum number of cars, 2 to 20.
            n_envs: Number of environments.
            room: Width along x and depth along y [m].
            half_axes: Half width and half depth of the loop [m]; by default `MARGIN` from walls.
            speed: Speed of each car [m/s].
            lookahead: Lead time of the reference velocity [s].
            reach: Distance up to which a car sees a wall [m].
            enough: Share of the walls at which the task is done.

        Raises:
            EnvError: An option is out of range, or the cars do not fit on the loop.
        """
        if half_axes is None:
            half_axes = [float(a) for a in half_room(room, MARGIN)]
        super().__init__(
            n_cars, n_envs, room, half_axes=half_axes, speed=speed, lookahead=lookahead
        )
        self._half: F64 = half_room(room, 0.0)
        self._reach, self._enough = positive("reach", reach), share("enough", enough)
        self._state: Truth | None = None
        self._points: list[F64] = [np.zeros((0, 2))] * n_envs
        self._seen: list[Bool] = [np.zeros(0, dtype=bool)] * n_envs
        self.coverage: F64 = np.zeros(n_envs)
        """Share of the walls that has been seen, (env)."""

    def begin(self, env: int, pos: F64, cars: I64) -> None:
        """Place the slots; no wall has been seen."""
        super().begin(env, pos, cars)
        self._points[env] = wall_points(self._half, self._boxes[env])
        self._seen[env] = np.zeros(len(self._points[env]), dtype=bool)
        self.coverage[env], self.done[env] = 0.0, False

    def update(self, state: Truth, t: F64, collided: F64, envs: slice) -> None:
        """Write all arrays for time t but those of the coverage, see `inform`."""
        super().update(state, t, collided, envs)
        self._state = state
        self.rewards[envs, :, -2] = -1.0 * (self._assigned[envs] & ~self.done[envs, None])

    def inform(self, cov: F64, ok: Bool, envs: slice) -> None:
        """Mark the walls that cars see which know where they are, and write the terms of it."""
        if self._state is None:
            return
        start, stop = self._range(envs)
        for env in range(start, stop):
            here, seen = self._assigned[env], self._seen[env]
            known = here & (ok[env].any(axis=-1) | (here.sum() < 2))
            gain = self.rewards[env, :, -1]
            see_walls(
                self._state.pos_w[env], known, self._points[env], self._boxes[env],
                self._reach, seen, gain,
            )  # fmt: skip
            self.coverage[env] += gain.sum()
            if self.coverage[env] >= self._enough and not self.done[env]:
                self.done[env] = True
                self.rewards[env, :, -2] = 0.0


def wall_points(half: F64, boxes: F64) -> F64:
    """Return points just in front of the walls of a room and of its boxes, (point, 2) [m].

    Args:
        half: Half width and half depth of the room [m].
        boxes: Centre, half width and depth [m], cosine, sine, (box, 6).
    """
    parts = [_edges(half[0] - TINY, half[1] - TINY)]
    for x, y, w, h, c, s in boxes:
        turned = _edges(w + TINY, h + TINY) @ np.array([[c, s], [-s, c]])
        parts.append(turned + [x, y])
    points: F64 = np.concatenate(parts)
    free = (np.abs(points) < half).all(axis=1)
    for x, y, w, h, c, s in boxes:
        own = (points - [x, y]) @ np.array([[c, -s], [s, c]])
        free &= ~((np.abs(own[:, 0]) < w) & (np.abs(own[:, 1]) < h))
    return points[free]


TINY = 0.01
"""[m] Distance of the points from their wall."""


def _edges(a: float, b: float) -> F64:
    """Return points on the edges of a rectangle of these half axes, `STEP` apart, (point, 2)."""
    xs, ys = (
        (np.arange(n) + 0.5) * 2.0 * h / n - h
        for h in (a, b)
        for n in [max(1, round(2 * h / STEP))]
    )
    return np.concatenate(
        [np.stack([xs, np.full_like(xs, e)], axis=1) for e in (-b, b)]
        + [np.stack([np.full_like(ys, e), ys], axis=1) for e in (-a, a)]
    )
