"""One room in the rigid-body solver: what happens when cars, walls and boxes touch."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pymunk
import pymunk.batch

from relpos_env.scenarios.obstacle import Obstacle
from relpos_env.vehicle import CarParams
from tracking.arrays import F64, I64

_FIELDS = (
    pymunk.batch.BodyFields.POSITION
    | pymunk.batch.BodyFields.ANGLE
    | pymunk.batch.BodyFields.VELOCITY
    | pymunk.batch.BodyFields.ANGULAR_VELOCITY
)
_INPUT = _FIELDS | pymunk.batch.BodyFields.FORCE | pymunk.batch.BodyFields.TORQUE
FRICTION, ELASTICITY = 0.3, 0.2
"""[-] Between any two bodies."""
BOX_DENSITY = 8.0
"""[kg/m2] Of a movable box, over its floor area: cardboard with little in it. The motor of a car
keeps one of up to 0.4 m moving; a larger one needs a run-up."""
BOX_FRICTION = 0.4
"""[-] Of a movable box on the floor."""
GRAVITY = 9.81
REST = 1e-4
"""[m/s, rad/s] A box that is slower stands."""


class Room:
    """The cars that are present and the boxes that they can push, in a space of their own.

    The state is the caller's: it is put into the space before every step and read back after.
    """

    def __init__(
        self, size: tuple[float, float], boxes: Sequence[Obstacle], car: CarParams, cars: I64
    ) -> None:
        """Build the room.

        Args:
            size: Width along x and depth along y [m]; the origin is the centre.
            boxes: What stands in it.
            car: The cars, all alike.
            cars: Numbers of the cars that are present, (present).
        """
        # A slice where it will do: numpy takes rows by their numbers one by one.
        everybody = np.array_equal(cars, np.arange(len(cars)))
        self._cars: slice | I64 = slice(len(cars)) if everybody else cars
        self._n_cars = len(cars)
        self._space = space = pymunk.Space()
        space.iterations = 10
        w, d = 0.5 * size[0], 0.5 * size[1]
        corners = [(-w, -d), (w, -d), (w, d), (-w, d)]
        for k in range(4):
            self._add(pymunk.Segment(space.static_body, corners[k], corners[(k + 1) % 4], 0.02))
        self._movable = np.array([k for k, box in enumerate(boxes) if box.movable], dtype=np.int64)
        bodies = []
        for _ in cars:
            body = pymunk.Body(car.mass, car.inertia)
            bodies.append(body)
            space.add(body)
            self._add(pymunk.Poly.create_box(body, (car.length, car.width), radius=0.01))
        self._box_numbers = []
        for box in boxes:
            if box.movable:
                mass = BOX_DENSITY * box.width * box.height
                inertia = mass * (box.width**2 + box.height**2) / 12.0
                self._box_numbers.append((mass, inertia, 0.25 * (box.width + box.height)))
                body = pymunk.Body(mass, inertia)
                space.add(body)
                self._add(pymunk.Poly.create_box(body, (box.width, box.height)))
            else:
                self._add(pymunk.Poly(space.static_body, [tuple(c) for c in box.corners()]))
        # The solver lists the static body behind the others, so the buffers have a row for it.
        n = len(cars) + len(self._movable)
        self._input = np.zeros((n + 1, 9))
        self._inbox, self._outbox = pymunk.batch.Buffer(), pymunk.batch.Buffer()
        self._inbox.set_float_buf(self._input)
        self._rows = {body.id: k for k, body in zip(cars, bodies, strict=True)}
        self._contacts: F64 = np.zeros(0)
        space.on_collision(begin=self._count)

    def step(self, body: F64, wrench: F64, box_body: F64, contacts: F64, dt: float) -> None:
        """Move everything by one step.

        Args:
            body: x, y, heading, velocities and yaw rate of all cars, (car, 6), updated.
            wrench: Force x, y [N] and torque [N m] on each, (car, 3).
            box_body: The same as `body` of all boxes, (box, 6), updated.
            contacts: Contacts that each car began, (car), counted up.
            dt: [s]
        """
        n, rows = self._n_cars, self._input
        rows[:n, :6], rows[:n, 6:] = body[self._cars], wrench[self._cars]
        if len(self._movable):
            boxes = box_body[self._movable]
            rows[n:-1, :6] = boxes
            rows[n:-1, 6:] = self._floor(boxes, dt)
        self._contacts = contacts
        pymunk.batch.set_space_bodies(self._space, _INPUT, self._inbox)
        self._space.step(dt)
        self._outbox.clear()
        pymunk.batch.get_space_bodies(self._space, _FIELDS, self._outbox)
        out = np.frombuffer(self._outbox.float_buf(), dtype=np.float64).reshape(-1, 6)
        body[self._cars] = out[:n]
        if len(self._movable):
            boxes = out[n : n + len(self._movable)].copy()
            boxes[(np.abs(boxes[:, 3:]) < REST).all(axis=1), 3:] = 0.0
            box_body[self._movable] = boxes

    def _add(self, shape: pymunk.Shape) -> None:
        shape.friction, shape.elasticity = FRICTION, ELASTICITY
        self._space.add(shape)

    def _floor(self, boxes: F64, dt: float) -> F64:
        """Friction of the floor on boxes, no more than what stops them, (box, 3) [N, N, N m]."""
        wrench = np.zeros((len(boxes), 3))
        for k, (mass, inertia, arm) in enumerate(self._box_numbers):
            grip = BOX_FRICTION * mass * GRAVITY
            speed = float(np.hypot(boxes[k, 3], boxes[k, 4]))
            if speed > 0.0:
                wrench[k, :2] = -min(mass / dt, grip / speed) * boxes[k, 3:5]
            spin = abs(float(boxes[k, 5]))
            if spin > 0.0:
                wrench[k, 2] = -min(inertia / dt, grip * arm / spin) * boxes[k, 5]
        return wrench

    def _count(self, arbiter: pymunk.Arbiter, space: pymunk.Space, data: object) -> None:
        for shape in arbiter.shapes:
            k = self._rows.get(shape.body.id) if shape.body else None
            if k is not None:
                self._contacts[k] += 1.0
