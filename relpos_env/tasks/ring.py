"""Task `ring`: evenly spaced cars drive round a loop.

The loop is a circle, or two half circles and straight sides between them. All cars accelerate
differently, so the group's rotation stays observable to their trackers.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from relpos_env.errors import EnvError
from relpos_env.tasks.base import COMMON_TERMS, Task, Truth
from relpos_env.tasks.geometry.assignment import assign_round
from relpos_env.tasks.geometry.curves import Curve, rounded
from relpos_env.tasks.geometry.shapes import MIN_SPACING
from relpos_env.tasks.kernels.ring import update_ring
from relpos_env.tasks.moving import ERROR_SCALE
from relpos_env.tasks.options import half_room, not_negative, positive
from tracking.arrays import F64, I64, Bool

SHARE = 0.28
"""[-] Radius of the ring divided by the smaller side of the room."""


class Ring(Task):
    """Evenly spaced slots that move counter-clockwise on a loop round the room; never ends."""

    _more_terms: tuple[str, ...] = ()
    """Reward terms of a subclass, after the others."""

    def __init__(
        self,
        n_cars: int,
        n_envs: int,
        room: tuple[float, float],
        *,
        half_axes: Sequence[float] | None = None,
        speed: float = 1.0,
        lookahead: float = 0.3,
    ) -> None:
        """Build the loop.

        Args:
            n_cars: Maximum number of cars, 2 to 20.
            n_envs: Number of environments.
            room: Width along x and depth along y [m].
            half_axes: Half width and half depth of the loop [m]; the smaller is the radius of
                its bends. By default a circle, `SHARE` of the smaller side of the room.
            speed: Speed of each car [m/s].
            lookahead: Lead time of the reference velocity [s].

        Raises:
            EnvError: An option is out of range, or the cars do not fit on the ring.
        """
        super().__init__(
            n_cars, n_envs, ("formation", "velocity", *COMMON_TERMS, *self._more_terms)
        )
        half = half_room(room, 0.0)
        axes = _half_axes(half_axes, half)
        self._curve = loop(*axes)
        self._motion = (
            self._curve.length,
            positive("speed", speed),
            not_negative("lookahead", lookahead),
            ERROR_SCALE,
        )
        if self._curve.length < MIN_SPACING * n_cars:
            raise EnvError(
                f"half_axes: {n_cars} cars need a loop of {MIN_SPACING * n_cars:.1f} m, "
                f"got one of {self._curve.length:.1f} m"
            )
        self._arc = np.zeros((n_envs, n_cars))

    def begin(self, env: int, pos: F64, cars: I64) -> None:
        """Place the slots nearest to the cars."""
        self._give(env, pos, cars, 0.0)

    def change(self, env: int, pos: F64, cars: I64, before: Bool, t: float) -> None:
        """Assign evenly spaced slots to the present cars, nearest to their positions."""
        self._give(env, pos, cars, t)

    def compute(self, state: Truth, t: F64, collided: F64, start: int, stop: int) -> int:
        """Run `update_ring`."""
        n_changed: int = update_ring(
            start, stop, state.pos_w, state.vel_w, state.accel_w, state.clearance,
            state.present, t, collided,
            self._assigned, self._arc, self._curve.pieces, self._motion, self.target, self.plan,
            self.goal_w, self.error, self.rewards,
        )  # fmt: skip
        return n_changed

    def _give(self, env: int, pos: F64, cars: I64, t: float) -> None:
        arc = self._curve.nearest(pos[cars])
        self._arc[env] = 0.0
        self._arc[env, cars] = assign_round(arc, self._curve.length) - self._motion[1] * t


def loop(a: float, b: float) -> Curve:
    """Return a closed curve of these half axes [m], counter-clockwise."""
    radius = min(a, b)
    if a == b:
        angle = np.linspace(0.0, 2.0 * np.pi, 1 + int(np.ceil(200.0 * np.pi * radius)))
        trace = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        return Curve.through(trace, True, eased=False)
    corners = np.array([[a, -b], [a, b], [-a, b], [-a, -b]])
    return Curve.through(rounded(corners, True, radius), True)


def _half_axes(value: Sequence[float] | None, half: F64) -> tuple[float, float]:
    """Return the half axes of the loop, checked to fit in the room.

    Raises:
        EnvError: The half axes do not fit, or are not two lengths.
    """
    if value is None:
        radius = 2.0 * SHARE * float(half.min())
        return radius, radius
    if isinstance(value, str) or np.shape(value) != (2,):
        raise EnvError(f"half_axes: expected two lengths, got {value!r}")
    a, b = (positive("half_axes", length) for length in value)
    if a > half[0] or b > half[1]:
        raise EnvError(
            f"half_axes: expected at most {half[0]:.2f} and {half[1]:.2f} m, got {a:g} and {b:g} m"
        )
    return a, b
