"""One room in the rigid-body solver: what happens when cars, walls and boxes touch."""

from __future__ import annotations

import math
from collections.abc import Sequence

import pymunk

from relpos_env.scenarios.obstacle import Obstacle
from relpos_env.vehicle import CarParams
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


class Room:
    """The cars that are present and the boxes that they can push, in a space of their own.

    The state is the caller's: it is put into the space before every step and read back after
    (`solver`). Bodies stand in the space in the order of their numbers, cars first.
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
        self.space = space = pymunk.Space()
        space.iterations = 10
        w, d = 0.5 * size[0], 0.5 * size[1]
        corners = [(-w, -d), (w, -d), (w, d), (-w, d)]
        for k in range(N_WALLS):
            a, b = corners[k], corners[(k + 1) % N_WALLS]
            wall = pymunk.Segment(space.static_body, a, b, WALL_RADIUS)
            self._add(wall)
        self.car_ids: dict[int, int] = {}
        """Number of a car to that of its body."""
        for n in cars.tolist():
            body = pymunk.Body(car.mass, car.inertia)
            self.car_ids[n] = body.id
            space.add(body)
            self._add(pymunk.Poly.create_box(body, (car.length, car.width), CAR_RADIUS))
        self.movable: list[int] = []
        """Numbers of the boxes that can be pushed."""
        for k, box in enumerate(boxes):
            if box.movable:
                self.movable.append(k)
                self._add_movable(box)
            else:
                self._add(pymunk.Poly(space.static_body, [tuple(c) for c in box.corners()]))

    def _add_movable(self, box: Obstacle) -> None:
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

    def _add(self, shape: pymunk.Shape) -> None:
        shape.friction, shape.elasticity = math.sqrt(FRICTION), math.sqrt(ELASTICITY)
        self.space.add(shape)
