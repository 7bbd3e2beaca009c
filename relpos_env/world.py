"""The world: cars, walls and obstacles in a pymunk space, and what blocks a line of sight."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pymunk
import pymunk.batch

from relpos_env._vehicle_kernels import drive_forces, steer
from relpos_env.interface.actions import DriveCommand
from relpos_env.vehicle import CarParams
from tracking.arrays import F64, Bool

CAR, OBSTACLE, WALL = 0b001, 0b010, 0b100
_READ = (
    pymunk.batch.BodyFields.POSITION
    | pymunk.batch.BodyFields.ANGLE
    | pymunk.batch.BodyFields.VELOCITY
    | pymunk.batch.BodyFields.ANGULAR_VELOCITY
)
_WRITE = pymunk.batch.BodyFields.FORCE | pymunk.batch.BodyFields.TORQUE


@dataclass(frozen=True, slots=True, kw_only=True)
class Obstacle:
    """A box on the floor, higher than the antennas."""

    x: float
    """[m] Centre."""
    y: float
    """[m]"""
    width: float
    """[m] Along x before turning."""
    height: float
    """[m] Along y before turning."""
    angle: float = 0.0
    """[rad]"""

    def corners(self) -> F64:
        """Corners in order, (4, 2) [m]."""
        c, s = np.cos(self.angle), np.sin(self.angle)
        half = 0.5 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * [self.width, self.height]
        corners: F64 = half @ np.array([[c, s], [-s, c]]) + [self.x, self.y]
        return corners


@dataclass(frozen=True, slots=True)
class WorldState:
    """The truth about every car, (car, ...)."""

    t: float
    """[s]"""
    pos_w: F64
    """(car, 2) [m]"""
    vel_w: F64
    """(car, 2) [m/s]"""
    accel_w: F64
    """Mean over the last step, (car, 2) [m/s2]."""
    heading: F64
    """(car) [rad]"""
    yaw_rate: F64
    """(car) [rad/s]"""
    steering: F64
    """(car) [rad]"""

    @property
    def speed(self) -> F64:
        """Forward speed, (car) [m/s]."""
        forward: F64 = (
            np.cos(self.heading) * self.vel_w[:, 0] + np.sin(self.heading) * self.vel_w[:, 1]
        )
        return forward


class World:
    """Cars that drive, slide and collide in a room; the origin is the room's centre."""

    def __init__(
        self,
        room: tuple[float, float],
        obstacles: tuple[Obstacle, ...],
        car: CarParams,
        start: F64,
    ) -> None:
        """Build the room and put cars in it.

        Args:
            room: Width along x and depth along y [m].
            obstacles: What stands in it.
            car: The cars, all alike.
            start: x, y, heading of each car, (car, 3) [m, m, rad].
        """
        self._car = car
        self._space = pymunk.Space()
        self._space.iterations = 10
        w, d = 0.5 * room[0], 0.5 * room[1]
        corners = [(-w, -d), (w, -d), (w, d), (-w, d)]
        solid = [
            pymunk.Segment(self._space.static_body, corners[k], corners[(k + 1) % 4], 0.02)
            for k in range(4)
        ]
        blocking = [
            pymunk.Poly(self._space.static_body, [tuple(c) for c in box.corners()])
            for box in obstacles
        ]
        for shape in [*solid, *blocking]:
            shape.friction, shape.elasticity = 0.3, 0.2
        for shape in solid:
            shape.filter = pymunk.ShapeFilter(categories=WALL)
        for shape in blocking:
            shape.filter = pymunk.ShapeFilter(categories=OBSTACLE)
        self._space.add(*solid, *blocking)
        for x, y, heading in start:
            body = pymunk.Body(car.mass, car.inertia)
            body.position, body.angle = (float(x), float(y)), float(heading)
            shape = pymunk.Poly.create_box(body, (car.length, car.width), radius=0.01)
            shape.friction, shape.elasticity = 0.3, 0.2
            shape.filter = pymunk.ShapeFilter(categories=CAR)
            self._space.add(body, shape)
        n = len(start)
        self._n_cars, self._tick = n, 0
        self.boxes: F64 = np.array(
            [
                (o.x, o.y, 0.5 * o.width, 0.5 * o.height, np.cos(o.angle), np.sin(o.angle))
                for o in obstacles
            ]
        ).reshape(-1, 6)
        """Obstacles for the radio: centre, half width and depth [m], cosine and sine, (box, 6)."""
        self._steering = np.zeros(n)
        # pymunk lists the static body behind the cars, so the buffers have a row for it.
        self._force = np.zeros((n + 1, 3))
        self._inbox, self._outbox = pymunk.batch.Buffer(), pymunk.batch.Buffer()
        self._outbox.set_float_buf(self._force)
        self.n_collisions = np.zeros(n, dtype=np.int64)
        """Contacts that each car began, with a car, a wall or an obstacle, (car)."""
        self._space.on_collision(begin=self._count_collision)
        self._bodies = {body.id: k for k, body in enumerate(self._space.bodies)}
        self.state = self._read(np.zeros((n, 2)), 0.0)

    def step(self, command: DriveCommand, dt: float) -> WorldState:
        """Move everything by one step [s]."""
        car, state = self._car, self.state
        steer(self._steering, command.steering, car.max_steering, car.steering_rate, dt)
        drive_forces(
            state.heading,
            state.vel_w,
            state.yaw_rate,
            self._steering,
            command.speed,
            car.mass,
            car.inertia,
            0.5 * car.wheelbase,
            car.friction,
            (car.speed_gain, car.max_accel, car.max_speed),
            dt,
            self._force[: self._n_cars],
        )
        pymunk.batch.set_space_bodies(self._space, _WRITE, self._outbox)
        self._space.step(dt)
        self._tick += 1
        self.state = self._read(state.vel_w, dt)
        return self.state

    def line_of_sight(self, a: F64, b: F64) -> bool:
        """True if no obstacle stands between two points, each (2) [m]."""
        blocking = pymunk.ShapeFilter(mask=OBSTACLE)
        hit = self._space.segment_query_first(
            (float(a[0]), float(a[1])), (float(b[0]), float(b[1])), 0.0, blocking
        )
        return hit is None

    def pairs_in_sight(self, pos: F64) -> Bool:
        """Line of sight between all points, (point, point)."""
        n = len(pos)
        sight = np.ones((n, n), dtype=bool)
        for a in range(n):
            for b in range(a + 1, n):
                sight[a, b] = sight[b, a] = self.line_of_sight(pos[a], pos[b])
        return sight

    def _read(self, last_vel: F64, dt: float) -> WorldState:
        self._inbox.clear()
        pymunk.batch.get_space_bodies(self._space, _READ, self._inbox)
        rows = np.frombuffer(self._inbox.float_buf(), dtype=np.float64).reshape(-1, 6)
        rows = rows[: self._n_cars].copy()
        vel = rows[:, 3:5]
        accel = (vel - last_vel) / dt if dt > 0.0 else np.zeros_like(vel)
        return WorldState(
            t=self._tick * dt,
            pos_w=rows[:, 0:2],
            vel_w=vel,
            accel_w=accel,
            heading=rows[:, 2],
            yaw_rate=rows[:, 5],
            steering=self._steering.copy(),
        )

    def _count_collision(self, arbiter: pymunk.Arbiter, space: pymunk.Space, data: object) -> None:
        for shape in arbiter.shapes:
            k = self._bodies.get(shape.body.id) if shape.body else None
            if k is not None:
                self.n_collisions[k] += 1
