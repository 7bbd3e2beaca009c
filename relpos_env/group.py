"""What a group of cars has besides numbers: its boxes, its room in the solver, its life."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from relpos_env.bodies import Bodies
from relpos_env.room import Room
from relpos_env.scenarios.floor import spacing
from relpos_env.scenarios.life import LifeEvent
from relpos_env.scenarios.obstacle import Obstacle
from relpos_env.scenarios.overlap import distance
from relpos_env.sensors.radio.radio import Radio
from relpos_env.solver import Solver, connect, disconnect
from relpos_env.timing import SOON
from relpos_env.vehicle import CarParams
from tracking.arrays import F64, Bool
from tracking.short_repr import short_repr

WAIT = 0.5
"""[s] A car that cannot come in, because another stands there, tries again after so long."""


@dataclass(slots=True)
class Group:
    """One environment; the whole of a batch and its parts have the same object."""

    __repr__ = short_repr

    life: tuple[LifeEvent, ...] = ()
    """What is still to happen, by rising time."""
    boots: np.random.Generator = field(default_factory=np.random.default_rng)
    """For what the radios draw when they are switched on."""
    obstacles: tuple[Obstacle, ...] = ()
    car: CarParams = field(default_factory=CarParams)
    size: tuple[float, float] = (0.0, 0.0)
    """[m] Width and depth of the room."""
    room: Room | None = None
    """Made when something is about to touch, for the solver that is connected to it."""

    def __getstate__(self) -> dict[str, Any]:
        """Everything but the room: what is touching then is solved anew."""
        return {f.name: getattr(self, f.name) for f in fields(self) if f.name != "room"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.room = None
        for name, value in state.items():
            setattr(self, name, value)

    @property
    def next_event(self) -> float:
        """When something happens to a car or a tracker next [s]; inf for never."""
        return self.life[0].t if self.life else np.inf

    def to_come(self) -> list[int]:
        """Cars that will come in, for the first time or again."""
        return [event.car for event in self.life if event.what == "join"]

    def movable(self, n_boxes: int) -> Bool:
        """Which of so many boxes can be pushed, (box)."""
        movable = np.zeros(n_boxes, dtype=bool)
        movable[: len(self.obstacles)] = [box.movable for box in self.obstacles]
        return movable

    def open_room(self, b: Bodies, solver: Solver, env: int) -> None:
        """Let the rigid-body solver make the next moves of the environment.

        The order in which a space takes its contacts is a matter of what it had before, so that
        each time something touches begins with a new one.
        """
        cars = np.nonzero(b.present[env])[0]
        self.room = Room(self.size, self.obstacles, self.car, cars)
        connect(solver, env, self.room, int(b.tick[env]))

    def close_room(self, solver: Solver, env: int) -> None:
        """Let what touches next begin anew."""
        disconnect(solver, env)
        self.room = None

    def live(
        self, b: Bodies, solver: Solver, radio: Radio, antennas: F64, env: int, t: float
    ) -> None:
        """Let happen what is due.

        Args:
            b: Cars, updated.
            solver: Disconnected where another number of cars is present from now on.
            radio: Their radios, updated.
            antennas: Where these are, (env, car, 3) [m], updated.
            env: Number of the environment in these.
            t: Now [s].
        """
        events = self.life
        while events and events[0].t <= t + SOON:
            event, events = events[0], events[1:]
            n = event.car
            if event.what == "join" and not b.present[env, n] and self._is_taken(b, env, event):
                later = replace(event, t=event.t + WAIT)
                events = tuple(sorted((*events, later), key=lambda each: each.t))
                continue
            if event.what == "leave" and not b.present[env, n]:
                # It still waits outside, and does not come in any more.
                waits = next((e for e in events if e.car == n and e.what == "join"), None)
                events = tuple(e for e in events if e is not waits)
            if not _makes_sense(event, b.present[env]):
                continue
            if event.what == "join":
                b.body[env, n], b.drive[env, n] = 0.0, 0.0
                b.body[env, n, :3] = event.pose
                antennas[env, n, :2] = b.body[env, n, :2]
                b.present[env, n] = True
            elif event.what == "leave":
                b.body[env, n, 3:] = 0.0
                b.present[env, n] = False
            if event.what in ("join", "leave"):
                self.close_room(solver, env)
            on = event.what in ("join", "power-on")
            if on and not b.powered[env, n]:
                radio.switch_on(env, n, boot=int(self.boots.integers(256)))
            elif not on and b.powered[env, n]:
                radio.switch_off(env, n)
            b.powered[env, n] = on
        self.life = events

    def _is_taken(self, b: Bodies, env: int, event: LifeEvent) -> bool:
        """True while a car or a box that was pushed stands where one is to come in."""
        assert event.pose is not None
        place = np.array(event.pose[:2])
        away = np.linalg.norm(b.body[env, b.present[env], :2] - place, axis=-1)
        if (away < spacing(self.car)).any():
            return True
        boxes = b.boxes[env]
        # Places to come in were drawn with more room than this beside the boxes.
        reach = 0.5 * np.hypot(self.car.length, self.car.width)
        pushed = boxes[self.movable(len(boxes))]
        return any(distance(place, box) < reach for box in pushed)


def _makes_sense(event: LifeEvent, present: Bool) -> bool:
    """Whether an event can happen: others were drawn as if nobody ever had to wait outside.

    Two cars at least stay.
    """
    if event.what == "join":
        return not present[event.car]
    return bool(present[event.car]) and (event.what != "leave" or int(present.sum()) > 2)
