"""Formation in a frame that stays, moves along a curve or turns: base of several tasks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relpos_env.errors import EnvError
from relpos_env.tasks.base import COMMON_TERMS, Task, Truth
from relpos_env.tasks.geometry.anchor import free_anchor
from relpos_env.tasks.geometry.assignment import assign
from relpos_env.tasks.geometry.curves import Curve
from relpos_env.tasks.geometry.shapes import Formation
from relpos_env.tasks.geometry.shortest_paths import Ways
from relpos_env.tasks.kernels.frame import frame_now, update_frame
from tracking.arrays import F64, I64, Bool
from tracking.params.short_repr import short_repr

ERROR_SCALE = 0.5
"""[m] Formation error over which half of the formation term falls off to exp(-1)."""
PLACE_SCALE = 1.0
"""[m] Distance between the means of positions and goals at which the place term is exp(-1)."""
TOLERANCE = 0.4
"""[m] Distance from its final slot within which a car has arrived: about a car's length."""
MARGIN = 0.3
"""[m] Minimum distance of slots from the walls of the room."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AnchorPlacement:
    """Placement of a stationary frame: at the group's mean position, or near it if obstructed."""

    half: tuple[float, float]
    """[m] Maximum distance from the room's middle along x and y."""
    room: tuple[float, float]
    """[m] Half width and half depth of the room."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Motion:
    """Motion of the frame of a formation."""

    __repr__ = short_repr

    curve: Curve
    """Path of the frame's origin."""
    speed: float = 0.0
    """[m/s] Speed along the curve."""
    rate: float = 0.0
    """[rad/s] Turning rate, added to that of the curve."""
    turning: bool = False
    """True if the frame's x axis points along the curve."""
    heading: float = 0.0
    """[rad] Initial heading of a frame that does not turn with the curve."""
    lookahead: float = 0.0
    """[s] Lead time of the reference velocity, which compensates the lag of the cars."""
    placement: AnchorPlacement | None = None
    """Placement of a stationary frame; None for a frame on a curve."""

    def __post_init__(self) -> None:
        if self.placement is not None and self.curve.length > 0.0:
            raise ValueError("placement: expected none of a frame that follows a curve")


class MovingFormation(Task):
    """Formation with slots fixed in a moving frame."""

    def __init__(
        self,
        n_cars: int,
        n_envs: int,
        formation: Formation,
        motion: Motion,
        *,
        led: bool = False,
        all_informed: bool = True,
        more_terms: tuple[str, ...] = (),
    ) -> None:
        """Combine a formation and a motion.

        Args:
            n_cars: Maximum number of cars.
            n_envs: Number of environments.
            formation: Slots in the frame.
            motion: Motion of the frame.
            led: True if the first present car has the first slot.
            all_informed: True if all cars receive the reference velocity; else only the first.
            more_terms: Reward terms of a subclass, after the others.
        """
        self._placement, self._ways = motion.placement, None
        terms: tuple[str, ...]
        if self._placement is not None:
            terms = ("formation", "place", *COMMON_TERMS, "progress")
            self._ways = Ways(n_cars, n_envs, self._placement.room)
        else:
            ends = motion.curve.length > 0.0 and not motion.curve.closed
            terms = ("formation", "velocity", *COMMON_TERMS, *(["time"] if ends else []))
        super().__init__(n_cars, n_envs, (*terms, *more_terms))
        self._formation, self._motion = formation, motion
        self._led, self._all_informed = led, all_informed
        self._frame, self._places = np.zeros((n_envs, 4)), np.zeros((n_envs, n_cars, 3))
        curve = motion.curve
        self._constants = (
            float(motion.speed),
            float(motion.rate),
            curve.length,
            float(curve.closed),
            float(motion.turning),
        )
        place_scale = 0.0 if self._placement is None else PLACE_SCALE
        self._limits = (float(motion.lookahead), TOLERANCE, ERROR_SCALE, place_scale)
        self._now = np.zeros(7)

    def begin(self, env: int, pos: F64, cars: I64) -> None:
        """Place the frame at the group's position and assign slots."""
        motion = self._motion
        middle = pos[cars].mean(axis=0)
        anchor, arc = np.zeros(2), 0.0
        if self._ways is not None:
            self._ways.lay(env, self._boxes[env])
        if self._placement is not None:
            anchor = self._free_anchor(self._placement, env, middle, len(cars))
        elif motion.curve.length > 0.0 and motion.curve.closed:
            arc = float(motion.curve.nearest(pos[cars[0]] if self._led else middle))
        heading = 0.0 if motion.turning else motion.heading
        self._frame[env] = (*anchor, arc, heading)
        self._give(env, pos, cars, 0.0)

    def set_goals(self, env: int, goals: F64, cars: I64) -> None:
        """Use the goals as slots of the present cars until cars join or leave."""
        if self._placement is None:
            raise EnvError("goals: expected none, the task has a way of its own")
        if len(goals) != len(cars):
            raise EnvError(f"goals: expected one for each of {len(cars)} cars, got {len(goals)}")
        if np.any(np.abs(goals) > self._placement.room):
            raise EnvError(f"goals: expected points in the room, got {goals.tolist()}")
        anchor = goals.mean(axis=0)
        c, s = np.cos(self._motion.heading), np.sin(self._motion.heading)
        self._frame[env, :2] = anchor
        self._places[env, cars, :2] = (goals - anchor) @ np.array([[c, -s], [s, c]])

    def change(self, env: int, pos: F64, cars: I64, before: Bool, t: float) -> None:
        """Assign slots to the present cars; the motion of the frame continues.

        A stationary frame moves if slots for this number of cars would be in an obstacle.
        """
        if self._placement is not None:
            requested = self._frame[env, :2]
            self._frame[env, :2] = self._free_anchor(self._placement, env, requested, len(cars))
        self._give(env, pos, cars, t)

    def update(self, state: Truth, t: F64, collided: F64, envs: slice) -> None:
        """Write all arrays for time t, with the `progress` term of a stationary formation.

        The term is not computed in `compute`, which runs twice when cars join or leave.
        """
        super().update(state, t, collided, envs)
        if self._ways is not None:
            start, stop = self._range(envs)
            self._ways.follow(state.pos_w, state.present, self.goal_w, start, stop)
            progress = self.rewards[..., self.terms.index("progress")]
            progress[start:stop] = self._ways.progress[start:stop]

    def compute(self, state: Truth, t: F64, collided: F64, start: int, stop: int) -> int:
        """Run `update_frame`."""
        n_changed: int = update_frame(
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
            self._frame,
            self._places,
            self._motion.curve.pieces,
            self._constants,
            self._limits,
            self.target,
            self.plan,
            self.goal_w,
            self.error,
            self.rewards,
            self.done,
        )
        return n_changed

    def _free_anchor(self, placement: AnchorPlacement, env: int, requested: F64, n: int) -> F64:
        """Return the feasible anchor of a formation of n cars nearest to `requested`, (2) [m]."""
        c, s = np.cos(self._motion.heading), np.sin(self._motion.heading)
        places = self._formation.places(n) @ np.array([[c, s], [-s, c]])
        return free_anchor(requested, np.array(placement.half), places, self._boxes[env])

    def _give(self, env: int, pos: F64, cars: I64, t: float) -> None:
        frame_now(env, t, self._frame, self._motion.curve.pieces, self._constants, self._now)
        x, y, c, s = self._now[:4]
        # Positions of the cars in the frame.
        own = (pos[cars] - [x, y]) @ np.array([[c, -s], [s, c]])
        places = self._formation.places(len(cars))
        if self._led:
            if len(cars) > 1:
                rest = assign(own[1:], places[1:])
                places = np.concatenate([places[:1], places[1:][rest]])
        else:
            places = places[assign(own, places)]
        self._places[env] = 0.0
        self._places[env, cars, :2] = places
        self._places[env, cars if self._all_informed else cars[:1], 2] = 1.0
