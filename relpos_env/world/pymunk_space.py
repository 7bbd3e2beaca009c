"""Pymunk space of one environment: cars, walls, boxes and added objects.

`PhysicsSpace.space` is an ordinary `pymunk.Space`. Added bodies, joints, shapes and collision
handlers interact with the cars. Radios, distance sensors and renderings treat each shape that is
not a sensor as a box: a polygon as the smallest rectangle around it, a circle as the square of
equal area. Shapes on the body of a car are part of the car and left out.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pymunk

from relpos_env.errors import EnvError
from relpos_env.scenarios.rooms.obstacle import THINNEST, Obstacle
from relpos_env.world.arrays import NO_BOX, Bodies, box_row
from relpos_env.world.car import CarParams
from tracking.arrays import I64
from tracking.geometry import GRAVITY

N_WALLS = 4
FRICTION, ELASTICITY = 0.09, 0.04
"""[-] Values between any two bodies; the solver multiplies those of both shapes. Small, so that
cars slide along obstacles: at 0.3 and 0.2 they catch on them and are thrown back."""
CAR_RADIUS, WALL_RADIUS = 0.01, 0.02
"""[m] Radius of the rounded edges, which extend the shapes; edges of boxes are sharp."""
BOX_FRICTION = 0.4
"""[-] Friction of a movable box on the floor."""
BOX_DENSITY = 8.0
"""[kg/m2] Mass of a movable box per floor area: cardboard with little in it. The motor of a car
moves a box of up to 0.4 m; larger ones move only at an impact."""
MOST_KNOWN = 100
"""[-] Largest number of cached rectangles."""
REST = 1e-4
"""[m/s, rad/s] Slower boxes are set to rest."""

Rectangle = tuple[float, float, float, float, float]
"""Centre x, y, width, height [m] and angle [rad], in the frame of a body."""


class PhysicsSpace:
    """Present cars and all objects that they can touch.

    The arrays of `Bodies` have the state of cars and boxes, too. Compiled code steps the space
    (`relpos_env.world.solver`) until other code obtains it; from then on `step` does, through the
    public interface of pymunk, with the same result.
    """

    def __init__(
        self, size: tuple[float, float], boxes: Sequence[Obstacle], car: CarParams, cars: I64
    ) -> None:
        """Build the space.

        Args:
            size: Width along x and depth along y [m]; the origin is the centre.
            boxes: Obstacles in the room.
            car: Parameters of all cars.
            cars: Indices of the present cars, (present).
        """
        self.space = space = pymunk.Space()
        space.iterations = 10
        self._car = car
        w, d = 0.5 * size[0], 0.5 * size[1]
        corners = [(-w, -d), (w, -d), (w, d), (-w, d)]
        for k in range(N_WALLS):
            a, b = corners[k], corners[(k + 1) % N_WALLS]
            self._add(pymunk.Segment(space.static_body, a, b, WALL_RADIUS))
        self.cars: dict[int, pymunk.Body] = {}
        """Bodies of the present cars, by index of the car."""
        for n in cars.tolist():
            self.add_car(n)
        self.boxes: dict[int, pymunk.Body] = {}
        """Bodies of the movable boxes, by index of the obstacle."""
        self._n_obstacles = len(boxes)
        for k, box in enumerate(boxes):
            if box.movable:
                self.boxes[k] = self._add_movable(box)
            else:
                self._add(pymunk.Poly(space.static_body, [tuple(c) for c in box.corners()]))
        self._own = set(space.shapes)
        self.is_open = False
        """True once other code has obtained the space."""
        self._rectangles: dict[tuple[Any, ...], Rectangle] = {}

    def add_car(self, n: int) -> None:
        """Add a car to the space; `put` sets its pose."""
        body = self.cars[n] = pymunk.Body(self._car.mass, self._car.inertia)
        self.space.add(body)
        size = self._car.length, self._car.width
        self._add(pymunk.Poly.create_box(body, size, CAR_RADIUS))

    def remove_car(self, n: int) -> None:
        """Remove a car from the space, with its shapes and joints."""
        body = self.cars.pop(n)
        self.space.remove(body, *body.shapes, *body.constraints)

    def put(self, b: Bodies, env: int) -> None:
        """Write the state of cars and boxes into the space."""
        for body, row in self._rows(b, env):
            x, y, angle, vx, vy, rate = row.tolist()
            body.position, body.angle = (x, y), angle
            body.velocity, body.angular_velocity = (vx, vy), rate

    def take(self, b: Bodies, env: int) -> None:
        """Read the state of cars and boxes, and the rectangles of added shapes, from the space.

        Raises:
            EnvError: There are more added shapes than free rows.
        """
        for body, row in self._rows(b, env):
            row[:] = *body.position, body.angle, *body.velocity, body.angular_velocity
        for k in self.boxes:
            x, y, angle = b.box_body[env, k, :3].tolist()
            b.boxes[env, k, [0, 1, 4, 5]] = x, y, math.cos(angle), math.sin(angle)
        added = [s for s in self.space.shapes if self._is_added(s)]
        room = b.boxes.shape[1] - self._n_obstacles
        if len(added) > room:
            raise EnvError(f"world.space: expected at most {room} added shapes, got {len(added)}")
        rows = b.boxes[env, self._n_obstacles :]
        rows[:] = NO_BOX
        known = self._rectangles
        if len(known) > MOST_KNOWN:
            known.clear()
        for k, shape in enumerate(added):
            key = _geometry(shape)
            if key not in known:
                known[key] = rectangle_of(shape)
            x, y, width, height, angle = known[key]
            centre = shape.body.local_to_world((x, y))
            rows[k] = box_row(centre.x, centre.y, width, height, shape.body.angle + angle)

    def reindex(self) -> None:
        """Update the index of queries after `put` has moved bodies."""
        for body in (*self.cars.values(), *self.boxes.values()):
            self.space.reindex_shapes_for_body(body)

    def step(self, b: Bodies, env: int, dt: float) -> None:
        """Make one step through the interface of pymunk.

        Args:
            b: Bodies with the forces on the cars; state and contacts are updated.
            env: Index of the environment in it.
            dt: Step [s].
        """
        for n, body in self.cars.items():
            x, y, torque = b.wrench[env, n].tolist()
            body.force += x, y
            body.torque += torque
        self.space.step(dt)
        for body in self.boxes.values():
            if max(*map(abs, body.velocity), abs(body.angular_velocity)) < REST:
                body.velocity, body.angular_velocity = (0.0, 0.0), 0.0
        self.take(b, env)
        for n, body in self.cars.items():
            body.each_arbiter(_count, b.contacts[env], n)

    def _is_added(self, shape: pymunk.Shape) -> bool:
        """Return whether a shape is an added obstacle: neither ours, nor a car's, nor a sensor."""
        is_ours = shape in self._own or shape.body in self.cars.values()
        return not (is_ours or shape.sensor)

    def _rows(self, b: Bodies, env: int) -> list[tuple[pymunk.Body, Any]]:
        """Return each body with the row of its state."""
        cars = [(body, b.body[env, n]) for n, body in self.cars.items()]
        return cars + [(body, b.box_body[env, k]) for k, body in self.boxes.items()]

    def _add_movable(self, box: Obstacle) -> pymunk.Body:
        mass = BOX_DENSITY * box.width * box.height
        body = pymunk.Body(mass, mass * (box.width**2 + box.height**2) / 12.0)
        self.space.add(body)
        self._add(pymunk.Poly.create_box(body, (box.width, box.height)))
        # Floor friction: joints with a limited force and without position correction. Forces
        # against the speed of the last step would let every pushed box creep.
        grip, floor = BOX_FRICTION * mass * GRAVITY, self.space.static_body
        pivot = pymunk.PivotJoint(floor, body, (0.0, 0.0), (0.0, 0.0))
        turn = pymunk.GearJoint(floor, body, 0.0, 1.0)
        pivot.max_force, turn.max_force = grip, grip * 0.25 * (box.width + box.height)
        for joint in (pivot, turn):
            joint.max_bias = 0.0
            self.space.add(joint)
        return body

    def _add(self, shape: pymunk.Shape) -> None:
        shape.friction, shape.elasticity = math.sqrt(FRICTION), math.sqrt(ELASTICITY)
        self.space.add(shape)


def rectangle_of(shape: pymunk.Shape) -> Rectangle:
    """Return the rectangle that sensors use for a shape."""
    if isinstance(shape, pymunk.Circle):
        side = math.sqrt(math.pi) * shape.radius
        return *shape.offset, side, side, 0.0
    if isinstance(shape, pymunk.Segment):
        along = shape.b - shape.a
        thickness = max(2.0 * shape.radius, THINNEST)
        return *(0.5 * (shape.a + shape.b)), along.length + thickness, thickness, along.angle
    assert isinstance(shape, pymunk.Poly)
    corners = np.array(shape.get_vertices())
    best, least = (0.0, 0.0, 0.0, 0.0, 0.0), math.inf
    # The smallest rectangle around a convex polygon has a side along one of its edges.
    for edge in np.roll(corners, -1, axis=0) - corners:
        angle = math.atan2(edge[1], edge[0])
        turn = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
        low, high = (corners @ turn.T).min(axis=0), (corners @ turn.T).max(axis=0)
        x, y = 0.5 * (low + high) @ turn
        width, height = high - low + 2.0 * shape.radius
        if width * height < least:
            best, least = (float(x), float(y), float(width), float(height), angle), width * height
    return best


def _geometry(shape: pymunk.Shape) -> tuple[Any, ...]:
    """Return the geometry that determines the rectangle of a shape; users may change it."""
    if isinstance(shape, pymunk.Circle):
        return shape.radius, shape.offset
    if isinstance(shape, pymunk.Segment):
        return shape.radius, shape.a, shape.b
    assert isinstance(shape, pymunk.Poly)
    return shape.radius, *shape.get_vertices()


def _count(arbiter: pymunk.Arbiter, contacts: Any, car: int) -> None:
    """Add a contact of a car to its count if it is new."""
    contacts[car] += arbiter.is_first_contact
