"""State of a group of cars outside the arrays: boxes, pymunk space, future events."""

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
"""[s] Delay until a car tries again to join if its pose is occupied."""


@dataclass(slots=True)
class RoomState:
    """State of one environment; a batch and its parts share the object."""

    __repr__ = short_repr

    life: tuple[LifeEvent, ...] = ()
    """Future events, by rising time."""
    boots: np.random.Generator = field(default_factory=np.random.default_rng)
    """Generator of the boot numbers of the radios when they are switched on."""
    obstacles: tuple[Obstacle, ...] = ()
    car: CarParams = field(default_factory=CarParams)
    size: tuple[float, float] = (0.0, 0.0)
    """[m] Width and depth of the room."""
    world: PhysicsSpace | None = None
    """Space of a whole episode; with `physics="fast"` that of the current contacts."""

    @property
    def next_event(self) -> float:
        """Time of the next event of a car or a tracker [s]; inf if there is none."""
        return self.life[0].t if self.life else np.inf

    def to_come(self) -> list[int]:
        """Return the cars that will join, for the first time or again."""
        return [event.car for event in self.life if event.what == "join"]

    def movable(self, n_boxes: int) -> Bool:
        """Return which boxes are movable, padded to `n_boxes`, (box)."""
        movable = np.zeros(n_boxes, dtype=bool)
        movable[: len(self.obstacles)] = [box.movable for box in self.obstacles]
        return movable

    def begin(self, b: Bodies, solver: Solver, env: int) -> None:
        """Build the space of an episode, unless its physics is fast."""
        disconnect(solver, env)
        self.world = None if b.fast[env] else self._build(b, env)

    def move(self, b: Bodies, solver: Solver, env: int, dt: float) -> None:
        """Connect the space of the environment for its next step, or make the step.

        Args:
            b: Bodies, updated.
            solver: Solver; connected if compiled code can make the step.
            env: Index of the environment in both.
            dt: Step [s].
        """
        if self.world is None or (b.fast[env] and not UNKNOWN):
            # The order of contacts in a space depends on its history, so that every sequence of
            # contacts begins with a new space.
            self.world = self._build(b, env)
        if UNKNOWN or self.world.is_open:
            if b.fast[env]:
                self.world.put(b, env)
            self.world.step(b, env, dt)
            b.stage[env] = MOVED
        else:
            connect(solver, env, self.world, int(b.tick[env]))

    def read(self, b: Bodies, env: int) -> None:
        """Read the changes by other code from the space."""
        if self.world is not None and self.world.is_open:
            self.world.take(b, env)

    def open(self, b: Bodies, solver: Solver, env: int) -> PhysicsSpace:
        """Return the space for other code to inspect and change.

        Raises:
            EnvError: The space is not kept.
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
        """Apply all due events.

        Args:
            b: Bodies, updated.
            solver: Solver; disconnected if a car joins or leaves.
            radio: Radios of the cars, updated.
            antennas: Positions of the antennas, (env, car, 3) [m], updated.
            env: Index of the environment in these.
            t: Current time [s].
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
                # The car still waits to join; its join is dropped.
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
        """Add a car to the space or remove it, as it joins or leaves."""
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
        """Return whether a car or a movable box occupies the pose of a car that joins."""
        assert event.pose is not None
        place = np.array(event.pose[:2])
        away = np.linalg.norm(b.body[env, b.present[env], :2] - place, axis=-1)
        if (away < spacing(self.car)).any():
            return True
        boxes = b.boxes[env]
        # Poses for joining are drawn with more clearance from boxes than this.
        reach = 0.5 * np.hypot(self.car.length, self.car.width)
        pushed = boxes[self.movable(len(boxes))]
        return any(distance(place, box) < reach for box in pushed)


def _makes_sense(event: LifeEvent, present: Bool) -> bool:
    """Return whether an event is possible: events are drawn as if no car had to wait to join.

    At least two cars stay present.
    """
    if event.what == "join":
        return not present[event.car]
    return bool(present[event.car]) and (event.what != "leave" or int(present.sum()) > 2)
