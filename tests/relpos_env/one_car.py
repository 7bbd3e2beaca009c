"""One car on an endless floor, for the tests of vehicles."""

import numpy as np

from relpos_env.timing import DT
from relpos_env.world._car_kernels import (
    HEADING,
    N_DRIVE,
    RATE,
    VX,
    VY,
    drive_cars,
    integrate_cars,
)
from relpos_env.world.car import CarParams, car_record


class Car:
    """One car on an endless floor, with its recorded motion."""

    def __init__(self, params=None, body=(0.0,) * 6, dt=DT):
        self.params, self.dt = params or CarParams(), dt
        self.cars = car_record(self.params, dt).reshape(1)
        self.body = np.array(body, dtype=float).reshape(1, 1, 6)
        self.drive = np.zeros((1, 1, N_DRIVE))
        self.wrench = np.zeros((1, 1, 3))
        self.present = np.ones((1, 1), dtype=bool)
        self.bodies, self.drives, self.wrenches = [self.body[0, 0].copy()], [], []

    def step(self, speed, steering):
        command = np.array([[speed]]), np.array([[steering]])
        drive_cars(
            self.cars, self.body, self.drive, self.present, *command, self.dt, self.wrench
        )  # fmt: skip
        integrate_cars(self.cars, self.body, self.present, self.wrench, self.dt)
        self.bodies.append(self.body[0, 0].copy())
        self.drives.append(self.drive[0, 0].copy())
        self.wrenches.append(self.wrench[0, 0].copy())

    def go(self, speed, steering, seconds):
        for _ in range(round(seconds / self.dt)):
            self.step(speed, steering)
        return self

    def energy(self):
        b, p = self.body[0, 0], self.params
        return 0.5 * p.mass * (b[VX] ** 2 + b[VY] ** 2) + 0.5 * p.inertia * b[RATE] ** 2

    @property
    def trace(self):
        return np.array(self.bodies)

    @property
    def drive_trace(self):
        return np.array(self.drives)


def forward(body):
    return np.cos(body[..., HEADING]) * body[..., VX] + np.sin(body[..., HEADING]) * body[..., VY]
