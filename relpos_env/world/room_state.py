"""What a group of cars has besides numbers: its boxes, its world in pymunk, its life."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from relpos_env.errors import EnvError
from relpos_env.scenarios.life import LifeEvent
from relpos_env.scenarios.rooms.floor import spacing
from relpos_env.scenarios.rooms.obstacle import Obstacle
from relpos_env.scenarios.rooms.overlap import distance
from relpos_env.sensors.radio.radio import Radio
from relpos_env.timing import SOON
from relpos_env.world._step_kernels import MOVED
from relpos_env.world.arrays import Bodies
from relpos_env.world.car import CarParams
from relpos_env.world.pymunk_space import PhysicsSpace
from relpos_env.world.solver import UNKNOWN, Solver, connect, disconnect
from tracking.arrays import F64, Bool
from tracking.params.short_repr import short_repr

WAIT = 0.5
"""[s] A car that cannot come in, because another stands there, tries again after so long."""


@dataclass(slots=True)
class RoomState:
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
    world: PhysicsSpace | None = None
    """Kept for a whole episode; with `physics="fast"` for as long as something touches."""

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

    def begin(self, b: Bodies, solver: Solver, env: int) -> None:
        """Build the world of an episode, if it is kept."""
        disconnect(solver, env)
        self.world = None if b.fast[env] else self._build(b, env)

    def move(self, b: Bodies, solver: Solver, env: int, dt: float) -> None:
        """Let the next step of the environment be made by its space, or make it.

        Args:
            b: Bodies, updated.
            solver: Connected, if compiled code can make the step.
            env: Number of the environment in these.
            dt: [s]
        """
        if self.world is None or (b.fast[env] and not UNKNOWN):
            # The order in which a space takes its contacts is a matter of what it had before, so
            # that each time something touches begins with a new one.
            self.world = self._build(b, env)
        if UNKNOWN or self.world.is_open:
            if b.fast[env]:
                self.world.put(b, env)
            self.world.step(b, env, dt)
            b.stage[env] = MOVED
        else:
            connect(solver, env, self.world, int(b.tick[env]))

    def read(self, b: Bodies, env: int) -> None:
        """Read from the space what others have changed in it."""
        if self.world is not None and self.world.is_open:
            self.world.take(b, env)

    def open(self, b: Bodies, solver: Solver, env: int) -> PhysicsSpace:
        """The world for others to look into and to change.

        Raises:
            EnvError: It is not kept.
        """
        if self.world is None or b.fast[env]:
            raise EnvError("world: expected physics 'pymunk', a fast one keeps no space")
        disconnect(solver, env)
        if not self.world.is_open:
            self.world.put(b, env)
            self.world.reindex()
            self.world.is_open = True
        return self.world

    def _build(self, b: Bodies, env: int) -> PhysicsSpace:
        world = PhysicsSpace(self.size, self.obstacles, self.car, np.nonzero(b.present[env])[0])
        world.put(b, env)
        return world

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
                b.body[env, n], b.drive[env, n], b.turned[env, n] = 0.0, 0.0, 0.0
                b.body[env, n, :3] = event.pose
                antennas[env, n, :2] = b.body[env, n, :2]
                b.present[env, n] = True
            elif event.what == "leave":
                b.body[env, n, 3:] = 0.0
                b.present[env, n] = False
            if event.what in ("join", "leave"):
                disconnect(solver, env)
                self._come_or_go(b, env, n)
            on = event.what in ("join", "power-on")
            if on and not b.powered[env, n]:
                radio.switch_on(env, n, boot=int(self.boots.integers(256)))
            elif not on and b.powered[env, n]:
                radio.switch_off(env, n)
            b.powered[env, n] = on
        self.life = events

    def _come_or_go(self, b: Bodies, env: int, car: int) -> None:
        """Let the world have the cars that are present."""
        if b.fast[env]:
            self.world = None
        elif self.world is not None and b.present[env, car]:
            self.world.add_car(car)
            self.world.put(b, env)
            if self.world.is_open:
                self.world.reindex()
        elif self.world is not None:
            self.world.remove_car(car)

    def _is_taken(self, b: Bodies, env: int, event: LifeEvent) -> bool:
        """True while a car or a box that was pushed stands where one is to come in."""
        assert event.pose is not None
        place = np.array(event.pose[:2])
        away = np.linalg.norm(b.body[env, b.present[env], :2] - place, axis=-1)
        if (away < spacing(self.car)).any():
            return True
        boxes = b.boxes[env]
        # Places to come in were drawn with more room than this next to the boxes.
        reach = 0.5 * np.hypot(self.car.length, self.car.width)
        pushed = boxes[self.movable(len(boxes))]
        return any(distance(place, box) < reach for box in pushed)


def _makes_sense(event: LifeEvent, present: Bool) -> bool:
    """Whether an event can happen: others were drawn as if no car ever had to wait outside.

    Two cars at least stay.
    """
    if event.what == "join":
        return not present[event.car]
    return bool(present[event.car]) and (event.what != "leave" or int(present.sum()) > 2)
