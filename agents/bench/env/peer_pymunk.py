"""Peer pymunk with the same rooms: a lower bound for a loop over rigid-body spaces.

Every room is a separate space with the walls, the obstacles of the scenario and three cars as
boxes. A step of 0.1 s consists only of:

- ten times `pymunk.batch.set_space_bodies` with one precomputed force on each car, which keeps it
  on the ring, and `space.step(0.01)`. No state is read.
- the positions of the three cars and one `segment_query_first` for each pair of them, as line of
  sight.

After 600 steps a room is rebuilt. There are no tyres, sensors, radio, tracker, operator, rewards
or observations. The cars touch nothing, so the solver has no contacts to solve.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from itertools import combinations
from math import ceil

import numpy as np
import pymunk
import pymunk.batch

from agents.bench.env.effort import EPISODE
from relpos_env.scenarios import Scenario, scenario
from relpos_env.timing import DECISION, DT
from tracking.arrays import F64

CARS = 3
SUB_STEPS = round(DECISION / DT)
PERIOD = 800
"""[-] Sub-steps of one revolution: 1.1 m/s on a ring of 1.4 m."""
CAR_CATEGORY = 0b10


def pymunk_name() -> str:
    """Return the name of the peer with its version."""
    return f"pymunk {pymunk.version}, no sensors"


@dataclass(frozen=True, slots=True, kw_only=True)
class _Room:
    space: pymunk.Space
    pairs: tuple[tuple[pymunk.Body, pymunk.Body], ...]


class Rooms:
    """Spaces with evenly spread episode phases."""

    def __init__(self, n_envs: int, *, resets: int, name: str) -> None:
        """Build the rooms.

        Args:
            n_envs: Number of rooms.
            resets: Rebuilt rooms per turn, which determine its number of steps.
            name: Name of the scenario.
        """
        self.n_envs, self._scenario = n_envs, scenario(name)
        self.steps = ceil(EPISODE * resets / n_envs)
        # The solver adds v dt to the position, then f dt / m to v. A car stays on the ring if v
        # rotates by the same angle every sub-step: f = m (v' - v) / dt.
        turn = 2.0 * np.pi / PERIOD
        self._velocity = _ring(self._scenario.ring[0], PERIOD, turn)
        gain = self._scenario.car.mass / DT
        change = np.roll(self._velocity, -1, axis=0) - self._velocity
        self._forces = [_buffer(gain * row) for row in change]
        self._spin, self._k = turn / DT, 0
        self._rooms = [self._build() for _ in range(n_envs)]
        self._ages = (EPISODE * np.arange(n_envs) // n_envs).tolist()
        self._sight = pymunk.ShapeFilter(mask=pymunk.ShapeFilter.ALL_MASKS() ^ CAR_CATEGORY)

    def turn(self) -> float:
        """Run a turn; return its time [us per env-step]."""
        began = time.perf_counter()
        for _ in range(self.steps):
            self._step()
        return 1e6 * (time.perf_counter() - began) / (self.steps * self.n_envs)

    def positions(self) -> F64:
        """Return the positions of the cars, (room, car, 2) [m]."""
        bodies = [list(room.space.bodies)[:CARS] for room in self._rooms]
        return np.array([[tuple(body.position) for body in cars] for cars in bodies])

    def _step(self) -> None:
        put, field, sight = (
            pymunk.batch.set_space_bodies, pymunk.batch.BodyFields.FORCE, self._sight
        )  # fmt: skip
        forces = [self._forces[(self._k + s) % PERIOD] for s in range(SUB_STEPS)]
        for e, room in enumerate(self._rooms):
            space = room.space
            for force in forces:
                put(space, field, force)
                space.step(DT)
            for a, b in room.pairs:
                space.segment_query_first(a.position, b.position, 0.0, sight)
            self._ages[e] += 1
            if self._ages[e] == EPISODE:
                self._ages[e] = -1
        self._k = (self._k + SUB_STEPS) % PERIOD
        for e, age in enumerate(self._ages):
            if age < 0:
                self._rooms[e], self._ages[e] = self._build(), 0

    def _build(self) -> _Room:
        s, space = self._scenario, pymunk.Space()
        w, d = 0.5 * s.room[0], 0.5 * s.room[1]
        corners = [(-w, -d), (w, -d), (w, d), (-w, d)]
        for k in range(4):
            space.add(pymunk.Segment(space.static_body, corners[k], corners[(k + 1) % 4], 0.02))
        for box in s.obstacles:
            space.add(pymunk.Poly(space.static_body, [tuple(c) for c in box.corners()]))
        bodies = _cars(s, space, self._velocity[self._k], self._spin)
        return _Room(space=space, pairs=tuple(combinations(bodies, 2)))


def _ring(radius: float, period: int, turn: float) -> F64:
    """Return velocities of cars on the ring, (sub-step, car, 2) [m/s]."""
    angle = turn * np.arange(period)[:, None] + 2.0 * np.pi * np.arange(CARS) / CARS
    speed = 2.0 * radius * np.sin(0.5 * turn) / DT
    velocity: F64 = speed * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    return velocity


def _cars(s: Scenario, space: pymunk.Space, velocity: F64, spin: float) -> list[pymunk.Body]:
    """Add cars on the ring with given velocities, (car, 2) [m/s]; return their bodies."""
    bodies, half = [], 0.5 * spin * DT
    for v in velocity:
        body = pymunk.Body(s.car.mass, s.car.inertia)
        angle = float(np.arctan2(v[1], v[0]))
        # The start of a chord is half a sub-step before the point whose tangent is parallel to it.
        x, y = s.ring[0] * np.sin(angle - half), -s.ring[0] * np.cos(angle - half)
        body.position, body.velocity = (float(x), float(y)), (float(v[0]), float(v[1]))
        body.angle, body.angular_velocity = angle, spin
        box = pymunk.Poly.create_box(body, (s.car.length, s.car.width), radius=0.01)
        box.filter = pymunk.ShapeFilter(categories=CAR_CATEGORY)
        space.add(body, box)
        bodies.append(body)
    return bodies


def _buffer(force: F64) -> pymunk.batch.Buffer:
    """Return a buffer of forces; the solver lists the static body after the others."""
    buffer = pymunk.batch.Buffer()
    buffer.set_float_buf(np.concatenate([force, np.zeros((1, 2))]))
    return buffer
