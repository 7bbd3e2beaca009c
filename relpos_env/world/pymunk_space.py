"""The pymunk space of one environment: cars, walls, boxes, and whatever else is put into it.

`PhysicsSpace.space` is an ordinary `pymunk.Space`. What is added to it (bodies, joints, shapes,
collision handlers) moves and collides with the cars. Radios, distance sensors and pictures see
each shape that is no sensor as a box: a polygon as the smallest rectangle around it, a circle as
the square of its area. Shapes on the body of a car are part of it, and not seen.
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
"""[-] Between any two bodies; the solver multiplies what the two shapes have. Little: cars slide
along what they touch. At 0.3 and 0.2 they catch on it and are thrown back."""
CAR_RADIUS, WALL_RADIUS = 0.01, 0.02
"""[m] Their edges are rounded, and stand out by so much; those of boxes are sharp."""
BOX_FRICTION = 0.4
"""[-] Of a movable box on the floor."""
BOX_DENSITY = 8.0
"""[kg/m2] Of a movable box, over its floor area: cardboard with little in it. The motor of a car
moves one of up to 0.4 m; what is larger yields to a blow only."""
MOST_KNOWN = 100
"""[-] Largest number of cached rectangles."""
REST = 1e-4
"""[m/s, rad/s] A box that is slower stands."""

Rectangle = tuple[float, float, float, float, float]
"""Centre x, y, width, height [m] and angle [rad], in the frame of a body."""


class PhysicsSpace:
    """The cars that are present and all that they can touch.

    The arrays of `Bodies` have the state of cars and boxes too. As long as no other code has the
    space, compiled code steps it (`relpos_env.world.solver`); from then on `step` does, by the
    public interface of pymunk, to the same result.
    """

    def __init__(
        self, size: tuple[float, float], boxes: Sequence[Obstacle], car: CarParams, cars: I64
    ) -> None:
        """Build the world.

        Args:
            size: Width along x and depth along y [m]; the origin is the centre.
            boxes: What stands in it.
            car: The cars, all alike.
            cars: Numbers of the cars that are present, (present).
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
        """By number, those that are present."""
        for n in cars.tolist():
            self.add_car(n)
        self.boxes: dict[int, pymunk.Body] = {}
        """Those that can be pushed, by their number among the obstacles."""
        self._n_obstacles = len(boxes)
        for k, box in enumerate(boxes):
            if box.movable:
                self.boxes[k] = self._add_movable(box)
            else:
                self._add(pymunk.Poly(space.static_body, [tuple(c) for c in box.corners()]))
        self._own = set(space.shapes)
        self.is_open = False
        """True from when other code has the space."""
        self._rectangles: dict[tuple[Any, ...], Rectangle] = {}

    def add_car(self, n: int) -> None:
        """Put a car into the space; `put` says where."""
        body = self.cars[n] = pymunk.Body(self._car.mass, self._car.inertia)
        self.space.add(body)
        size = self._car.length, self._car.width
        self._add(pymunk.Poly.create_box(body, size, CAR_RADIUS))

    def remove_car(self, n: int) -> None:
        """Take a car out of the space, with all that hangs on it."""
        body = self.cars.pop(n)
        self.space.remove(body, *body.shapes, *body.constraints)

    def put(self, b: Bodies, env: int) -> None:
        """Write the state of cars and boxes into the space."""
        for body, row in self._rows(b, env):
            x, y, angle, vx, vy, rate = row.tolist()
            body.position, body.angle = (x, y), angle
            body.velocity, body.angular_velocity = (vx, vy), rate

    def take(self, b: Bodies, env: int) -> None:
        """Read the state of cars and boxes, and where all else is, from the space.

        Raises:
            EnvError: More shapes than there is room for.
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
        """Let queries find shapes where `put` has moved their bodies to."""
        for body in (*self.cars.values(), *self.boxes.values()):
            self.space.reindex_shapes_for_body(body)

    def step(self, b: Bodies, env: int, dt: float) -> None:
        """Make one step by the interface of pymunk.

        Args:
            b: Forces on the cars; state and contacts are updated.
            env: Number of the environment in it.
            dt: [s]
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
        """True for shapes that hide and block: neither ours, nor a car's, nor a sensor."""
        is_ours = shape in self._own or shape.body in self.cars.values()
        return not (is_ours or shape.sensor)

    def _rows(self, b: Bodies, env: int) -> list[tuple[pymunk.Body, Any]]:
        """Each body with the row of its state."""
        cars = [(body, b.body[env, n]) for n, body in self.cars.items()]
        return cars + [(body, b.box_body[env, k]) for k, body in self.boxes.items()]

    def _add_movable(self, box: Obstacle) -> pymunk.Body:
        mass = BOX_DENSITY * box.width * box.height
        body = pymunk.Body(mass, mass * (box.width**2 + box.height**2) / 12.0)
        self.space.add(body)
        self._add(pymunk.Poly.create_box(body, (box.width, box.height)))
        # The floor holds it in place by up to so much, and turns nothing back: joints that yield.
        # As forces against the speed of the last step it would let every push creep.
        grip, floor = BOX_FRICTION * mass * GRAVITY, self.space.static_body
        stand = pymunk.PivotJoint(floor, body, (0.0, 0.0), (0.0, 0.0))
        turn = pymunk.GearJoint(floor, body, 0.0, 1.0)
        stand.max_force, turn.max_force = grip, grip * 0.25 * (box.width + box.height)
        for joint in (stand, turn):
            joint.max_bias = 0.0
            self.space.add(joint)
        return body

    def _add(self, shape: pymunk.Shape) -> None:
        shape.friction, shape.elasticity = math.sqrt(FRICTION), math.sqrt(ELASTICITY)
        self.space.add(shape)


def rectangle_of(shape: pymunk.Shape) -> Rectangle:
    """What sensors take a shape for."""
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
    """What its rectangle depends on; users may change it."""
    if isinstance(shape, pymunk.Circle):
        return shape.radius, shape.offset
    if isinstance(shape, pymunk.Segment):
        return shape.radius, shape.a, shape.b
    assert isinstance(shape, pymunk.Poly)
    return shape.radius, *shape.get_vertices()


def _count(arbiter: pymunk.Arbiter, contacts: Any, car: int) -> None:
    """Count a contact that a car begins."""
    contacts[car] += arbiter.is_first_contact
