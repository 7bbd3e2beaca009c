"""Arrays of cars and boxes, over environments."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from relpos_env.scenarios.episode import Episode
from relpos_env.timing import DT
from relpos_env.world._car_kernels import N_DRIVE
from relpos_env.world.car import CAR, car_record

Array = NDArray[Any]
NO_BOX = (1e6, 1e6, 0.0, 0.0, 1.0, 0.0)
"""Row without a box, far away from all cars."""
LONG_AGO = -(1 << 40)
"""[-] Number of a step before all others."""


class Bodies(NamedTuple):
    """State of cars and boxes, arrays over (env, ...)."""

    body: Array
    """x, y [m], heading [rad], vx, vy [m/s], yaw rate [rad/s]; (env, car, 6)."""
    drive: Array
    """Servo, motor, roll and pitch, (env, car, N_DRIVE)."""
    wrench: Array
    """Force x, y [N] and torque [N m], (env, car, 3)."""
    accel: Array
    """Mean acceleration over the last step, world frame, (env, car, 2) [m/s2]."""
    turn: Array
    """Mean yaw rate over the last step, (env, car) [rad/s]."""
    turned: Array
    """Mean yaw rate over the step before the last, (env, car) [rad/s]."""
    present: Array
    """True if the car is in the room, (env, car)."""
    powered: Array
    """True if the tracker of the car has power, (env, car)."""
    contacts: Array
    """Contacts that each car began in this control period, (env, car)."""
    touched: Array
    """Step of each car's last contact with each other car and, at the end, with any other object,
    (env, car, car + 1)."""
    cars: Array
    """CAR, (env)."""
    size: Array
    """Half length and width of a car [m], (env, 2)."""
    room: Array
    """Half width and depth [m], (env, 2)."""
    boxes: Array
    """Centre, half width and depth [m], cosine, sine; `NO_BOX` if unused; (env, box, 6)."""
    box_body: Array
    """x, y, angle and velocities of boxes, (env, box, 6)."""
    tick: Array
    """Steps since the environment began, (env)."""
    done: Array
    """Completed steps of this control period, (env)."""
    calm: Array
    """Steps for which the solver stays in use, (env)."""
    stage: Array
    """Stage of the current step, see `relpos_env.world._step_kernels`, (env)."""
    fast: Array
    """True if steps without contacts are made without the space, (env)."""


def make_bodies(n_envs: int, n_cars: int, n_boxes: int) -> Bodies:
    """Return the arrays of a batch without cars and boxes."""
    e, n = n_envs, n_cars
    return Bodies(
        body=np.zeros((e, n, 6)),
        drive=np.zeros((e, n, N_DRIVE)),
        wrench=np.zeros((e, n, 3)),
        accel=np.zeros((e, n, 2)),
        turn=np.zeros((e, n)),
        turned=np.zeros((e, n)),
        present=np.zeros((e, n), dtype=bool),
        powered=np.zeros((e, n), dtype=bool),
        contacts=np.zeros((e, n)),
        touched=np.full((e, n, n + 1), LONG_AGO, dtype=np.int64),
        cars=np.zeros(e, dtype=CAR),
        size=np.zeros((e, 2)),
        room=np.zeros((e, 2)),
        boxes=np.zeros((e, n_boxes, 6)),
        box_body=np.zeros((e, n_boxes, 6)),
        tick=np.zeros(e, dtype=np.int64),
        done=np.zeros(e, dtype=np.int64),
        calm=np.zeros(e, dtype=np.int64),
        stage=np.zeros(e, dtype=np.int64),
        fast=np.zeros(e, dtype=bool),
    )


def place_bodies(b: Bodies, env: int, episode: Episode, room: tuple[float, float]) -> None:
    """Write the initial state of an episode's cars and boxes into an environment.

    Args:
        b: Bodies, written.
        env: Index of the environment.
        episode: Episode with its cars and boxes.
        room: Width and depth [m].
    """
    for array in (
        b.body,
        b.drive,
        b.wrench,
        b.accel,
        b.turn,
        b.turned,
        b.contacts,
        b.boxes,
        b.box_body,
    ):
        array[env] = 0.0
    b.touched[env] = LONG_AGO
    b.boxes[env] = NO_BOX
    b.body[env, :, :3] = episode.start
    b.present[env] = b.powered[env] = episode.present
    b.cars[env] = car_record(episode.car, DT)
    b.size[env] = 0.5 * episode.car.length, 0.5 * episode.car.width
    b.room[env] = 0.5 * room[0], 0.5 * room[1]
    for k, box in enumerate(episode.obstacles):
        b.box_body[env, k, :3] = box.x, box.y, box.angle
        b.boxes[env, k] = box_row(box.x, box.y, box.width, box.height, box.angle)
    b.tick[env] = b.done[env] = b.calm[env] = b.stage[env] = 0


def box_row(x: float, y: float, width: float, height: float, angle: float) -> tuple[float, ...]:
    """Return a box for the kernels: centre, half width and depth [m], cosine, sine."""
    return x, y, 0.5 * width, 0.5 * height, float(np.cos(angle)), float(np.sin(angle))
