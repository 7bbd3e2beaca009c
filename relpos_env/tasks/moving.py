"""A formation in a frame that may stay, move along a curve and turn: what four tasks share."""

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
"""[m] Distance of the group's middle from its goals' at which the place term is exp(-1)."""
TOLERANCE = 0.4
"""[m] As near to its place at the end a car has arrived: about its length."""
MARGIN = 0.3
"""[m] From the walls of the room to the places nearest to them."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Stand:
    """A frame stands where the group did, or near it where no place is in an obstacle."""

    half: tuple[float, float]
    """[m] So far from the room's middle at most."""
    room: tuple[float, float]
    """[m] Half the width and depth of the room."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Motion:
    """How the frame of a formation moves."""

    __repr__ = short_repr

    curve: Curve
    """What its origin follows."""
    speed: float = 0.0
    """[m/s] Along the curve."""
    rate: float = 0.0
    """[rad/s] Of turning, besides what the curve asks for."""
    turning: bool = False
    """The frame's x axis points along the curve."""
    heading: float = 0.0
    """[rad] Of the frame at the start, if it does not turn with the curve."""
    lookahead: float = 0.0
    """[s] The plan is the velocity of the goal so much later, which covers the cars' lag."""
    stand: Stand | None = None
    """Where the frame may stand; None for one that is put by its curve alone."""

    def __post_init__(self) -> None:
        if self.stand is not None and self.curve.length > 0.0:
            raise ValueError("stand: expected none of a frame that follows a curve")


class MovingFormation(Task):
    """Cars with places in a moving frame."""

    def __init__(
        self,
        n_cars: int,
        n_envs: int,
        formation: Formation,
        motion: Motion,
        *,
        led: bool = False,
        all_told: bool = True,
    ) -> None:
        """Put the parts together.

        Args:
            n_cars: Slots for cars.
            n_envs: Environments.
            formation: Places in the frame.
            motion: Of the frame.
            led: The first present car has the first place.
            all_told: The plan is for all; else for the first present car alone.
        """
        self._stand, self._ways = motion.stand, None
        terms: tuple[str, ...]
        if self._stand is not None:
            terms = ("formation", "place", *COMMON_TERMS, "progress")
            self._ways = Ways(n_cars, n_envs, self._stand.room)
        else:
            ends = motion.curve.length > 0.0 and not motion.curve.closed
            terms = ("formation", "velocity", *COMMON_TERMS, *(["time"] if ends else []))
        super().__init__(n_cars, n_envs, terms)
        self._formation, self._motion = formation, motion
        self._led, self._all_told = led, all_told
        self._frame, self._places = np.zeros((n_envs, 4)), np.zeros((n_envs, n_cars, 3))
        curve = motion.curve
        self._constants = (
            float(motion.speed),
            float(motion.rate),
            curve.length,
            float(curve.closed),
            float(motion.turning),
        )
        place_scale = 0.0 if self._stand is None else PLACE_SCALE
        self._limits = (float(motion.lookahead), TOLERANCE, ERROR_SCALE, place_scale)
        self._now = np.zeros(7)

    def begin(self, env: int, pos: F64, cars: I64) -> None:
        """Put the frame where the group stands, and give out places."""
        motion = self._motion
        middle = pos[cars].mean(axis=0)
        anchor, arc = np.zeros(2), 0.0
        if self._ways is not None:
            self._ways.lay(env, self._boxes[env])
        if self._stand is not None:
            anchor = self._free_anchor(self._stand, env, middle, len(cars))
        elif motion.curve.length > 0.0 and motion.curve.closed:
            arc = float(motion.curve.nearest(pos[cars[0]] if self._led else middle))
        heading = 0.0 if motion.turning else motion.heading
        self._frame[env] = (*anchor, arc, heading)
        self._give(env, pos, cars, 0.0)

    def set_goals(self, env: int, goals: F64, cars: I64) -> None:
        """Let each present car stand at its goal, until cars come or go."""
        if self._stand is None:
            raise EnvError("goals: expected none, the task has a way of its own")
        if len(goals) != len(cars):
            raise EnvError(f"goals: expected one for each of {len(cars)} cars, got {len(goals)}")
        if np.any(np.abs(goals) > self._stand.room):
            raise EnvError(f"goals: expected points in the room, got {goals.tolist()}")
        anchor = goals.mean(axis=0)
        c, s = np.cos(self._motion.heading), np.sin(self._motion.heading)
        self._frame[env, :2] = anchor
        self._places[env, cars, :2] = (goals - anchor) @ np.array([[c, -s], [s, c]])

    def change(self, env: int, pos: F64, cars: I64, before: Bool, t: float) -> None:
        """Give out places for those who are present now; the frame goes on as it did.

        One that stands makes way where the places of so many would be in an obstacle.
        """
        if self._stand is not None:
            wanted = self._frame[env, :2]
            self._frame[env, :2] = self._free_anchor(self._stand, env, wanted, len(cars))
        self._give(env, pos, cars, t)

    def update(self, state: Truth, t: F64, collided: F64, envs: slice) -> None:
        """Write all arrays for now; cars that gather are paid for coming nearer since before.

        Not in `compute`, which is called twice where cars come or go.
        """
        super().update(state, t, collided, envs)
        if self._ways is not None:
            start, stop = self._range(envs)
            self._ways.follow(state.pos_w, state.present, self.goal_w, start, stop)
            progress = self.rewards[..., self.terms.index("progress")]
            progress[start:stop] = self._ways.progress[start:stop]

    def compute(self, state: Truth, t: F64, collided: F64, start: int, stop: int) -> int:
        """One compiled call."""
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
            self._seated,
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

    def _free_anchor(self, stand: Stand, env: int, wanted: F64, n: int) -> F64:
        """Where a formation of n cars can stand, nearest to where it is wanted, (2) [m]."""
        c, s = np.cos(self._motion.heading), np.sin(self._motion.heading)
        places = self._formation.places(n) @ np.array([[c, s], [-s, c]])
        return free_anchor(wanted, np.array(stand.half), places, self._boxes[env])

    def _give(self, env: int, pos: F64, cars: I64, t: float) -> None:
        frame_now(env, t, self._frame, self._motion.curve.pieces, self._constants, self._now)
        x, y, c, s = self._now[:4]
        # Where the cars stand, in the frame.
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
        self._places[env, cars if self._all_told else cars[:1], 2] = 1.0
