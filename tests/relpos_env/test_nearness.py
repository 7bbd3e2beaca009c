"""Broad phase of the detection of imminent contacts."""

import numpy as np
import pytest

from relpos_env.geometry._broad_phase_kernels import MARGIN, is_far
from relpos_env.scenarios.rooms.overlap import beyond_walls, car_boxes, overlap
from relpos_env.world.car import CarParams

ROOM = (6.0, 5.0)


@pytest.mark.parametrize("seed", range(5))
def test_what_is_far_touches_nothing_however_it_is_turned(seed):
    rng = np.random.default_rng(seed)
    car, n_far = CarParams(), 0
    reach = 0.5 * (car.length + car.width)
    for _ in range(400):
        body = np.zeros((1, 3, 6))
        body[0, :, 0], body[0, :, 1] = rng.uniform(-3.0, 3.0, 3), rng.uniform(-2.5, 2.5, 3)
        body[0, :, 2] = rng.uniform(-np.pi, np.pi, 3)
        angle = rng.uniform(-np.pi, np.pi)
        box = [*rng.uniform(-2.0, 2.0, 2), *rng.uniform(0.1, 0.8, 2), np.cos(angle), np.sin(angle)]
        boxes = np.array([[box, [9.0, 9.0, 0.0, 0.0, 1.0, 0.0]]])
        present = np.array([[True, True, rng.random() < 0.5]])
        room = np.array([[0.5 * ROOM[0], 0.5 * ROOM[1]]])
        taken = car_boxes(body[0, :, :3], car, 0.5 * MARGIN)
        met = overlap(taken, taken) & present[0] & ~np.eye(3, dtype=bool)
        hit = overlap(taken, boxes[0, :1])[:, 0] | beyond_walls(taken, ROOM)
        for n in np.flatnonzero(present[0]):
            if is_far(body, present, boxes, room, reach, 0, n):
                n_far += 1
                assert not hit[n]
                assert not met[n, n + 1 :].any()  # earlier cars have checked this one
    assert n_far > 50
