"""Solver steps without the interpreter equal those of pymunk with it."""

from dataclasses import replace

import numpy as np
import pymunk
import pytest
from pymunk.batch import BodyFields, Buffer, get_space_bodies, set_space_bodies

from relpos_env.scenarios import SCENARIOS, draw_episode
from relpos_env.scenarios.rooms.obstacle import Obstacle
from relpos_env.timing import DT
from relpos_env.world import solver as solver_module
from relpos_env.world._contact_kernels import solve
from relpos_env.world.arrays import make_bodies, place_bodies
from relpos_env.world.car import CarParams
from relpos_env.world.pymunk_space import REST, PhysicsSpace
from relpos_env.world.room_state import RoomState
from relpos_env.world.solver import connect, disconnect, make_solver

STATE = BodyFields.POSITION | BodyFields.ANGLE | BodyFields.VELOCITY | BodyFields.ANGULAR_VELOCITY
INPUT = STATE | BodyFields.FORCE | BodyFields.TORQUE
SIZE = (3.0, 2.4)
CAR = CarParams(mass=2.3)
BOXES = (
    Obstacle(x=0.4, y=0.1, width=0.3, height=0.2, angle=0.4, movable=True),
    Obstacle(x=-0.9, y=-0.7, width=0.3, height=0.4),
    Obstacle(x=0.9, y=-0.6, width=0.2, height=0.2, movable=True),
)
CARS = np.array([0, 1, 3])
N_CARS = 4


class Plain:
    """A room stepped through the interface of pymunk."""

    def __init__(self):
        self.room = PhysicsSpace(SIZE, BOXES, CAR, CARS)
        self.inbox, self.outbox = Buffer(), Buffer()
        self.room.space.on_collision(begin=self.count)
        self.contacts = np.zeros(N_CARS)

    def count(self, arbiter, space, data):
        for shape in arbiter.shapes:
            for car, body in self.room.cars.items():
                self.contacts[car] += shape.body is body

    def step(self, body, wrench, box_body):
        movable = list(self.room.boxes)
        rows = np.zeros((len(CARS) + len(movable) + 1, 9))
        rows[: len(CARS)] = np.hstack([body[CARS], wrench[CARS]])
        for row, box in zip(rows[len(CARS) :], movable, strict=False):
            row[:6] = box_body[box]
        self.inbox.set_float_buf(rows)
        set_space_bodies(self.room.space, INPUT, self.inbox)
        self.room.space.step(DT)
        self.outbox.clear()
        get_space_bodies(self.room.space, STATE, self.outbox)
        out = np.frombuffer(self.outbox.float_buf()).reshape(-1, 6)
        body[CARS] = out[: len(CARS)]
        for box, row in zip(movable, out[len(CARS) :], strict=False):
            box_body[box] = row
            if (np.abs(row[3:]) < REST).all():
                box_body[box, 3:] = 0.0


def crowded(n_envs=3, env=1):
    """Return bodies with an environment full of cars and boxes, and its solver."""
    bodies = make_bodies(n_envs, N_CARS, len(BOXES))
    present = np.isin(np.arange(N_CARS), CARS)
    start = np.array([[-0.5, 0.2, 0.0], [0.9, 0.5, 2.0], [9.0, 9.0, 1.0], [-0.2, -0.7, 1.0]])
    drawn = draw_episode(SCENARIOS["cars-los"], N_CARS, 10.0, np.random.default_rng(0))
    episode = replace(drawn, start=start, present=present, obstacles=BOXES, car=CAR)
    place_bodies(bodies, env, episode, SIZE)
    return bodies, make_solver(n_envs, N_CARS, len(BOXES))


@pytest.mark.parametrize("seed", range(4))
def test_moves_and_contacts_are_those_of_pymunk_bit_for_bit(seed):
    rng = np.random.default_rng(seed)
    bodies, solver = crowded()
    plain, room = Plain(), PhysicsSpace(SIZE, BOXES, CAR, CARS)
    connect(solver, 1, room, 0)
    body, box_body = bodies.body[1].copy(), bodies.box_body[1].copy()
    for k in range(600):
        if k % 40 == 0:
            push = rng.normal(size=(N_CARS, 3)) * [40.0, 40.0, 2.0]
        bodies.wrench[1] = push
        solve(bodies, solver, 1, DT)
        plain.step(body, push, box_body)
        np.testing.assert_array_equal(bodies.body[1], body, err_msg=f"step {k}")
        np.testing.assert_array_equal(bodies.box_body[1], box_body, err_msg=f"step {k}")
        np.testing.assert_array_equal(bodies.contacts[1], plain.contacts, err_msg=f"step {k}")
    assert plain.contacts[CARS].min() > 2
    assert plain.contacts[2] == 0
    assert solver.calls["moves"].tolist() == [0, 600, 0]
    assert solver.calls["ready"].tolist() == [-1, 600, -1]
    moved = np.abs(bodies.box_body[1, :, :2] - [(b.x, b.y) for b in BOXES]).max(axis=1)
    assert (moved[[0, 2]] > 0.1).any()
    assert moved[1] == 0.0
    for array in (bodies.body, bodies.box_body, bodies.contacts, solver.bodies, solver.moved):
        assert not array[[0, 2]].any()


def test_a_box_is_drawn_where_it_stands():
    bodies, solver = crowded()
    room = PhysicsSpace(SIZE, BOXES, CAR, CARS)
    connect(solver, 1, room, 0)
    bodies.box_body[1, 0, 3:] = 0.5, 0.2, 1.0
    for _ in range(10):
        solve(bodies, solver, 1, DT)
    x, y, angle = bodies.box_body[1, 0, :3]
    expected = [x, y, 0.15, 0.1, np.cos(angle), np.sin(angle)]
    np.testing.assert_allclose(bodies.boxes[1, 0], expected, rtol=1e-15)
    assert angle != 0.4


def test_the_solvers_arrays_keep_their_room():
    # If its arrays were too small, the C code would allocate others.
    bodies, solver = crowded()
    room = PhysicsSpace(SIZE, BOXES, CAR, CARS)
    connect(solver, 1, room, 0)
    calls = solver.calls[1]
    places = [int(calls[f"{way}_arr"]) for way in ("put", "got", "met")]
    rng = np.random.default_rng(0)
    for _ in range(200):
        bodies.body[1, CARS, :2] = rng.uniform(-1.0, 1.0, (len(CARS), 2))  # all overlap
        bodies.box_body[1, [0, 2], :2] = rng.uniform(-1.0, 1.0, (2, 2))
        solve(bodies, solver, 1, DT)
    assert [int(calls[f"{way}_arr"]) for way in ("put", "got", "met")] == places
    assert [calls[f"{way}_max"] for way in ("put", "got", "met")] == [
        solver.bodies[1].size, solver.moved[1].size, solver.met[1].size
    ]  # fmt: skip


def test_a_kept_world_follows_cars_that_come_and_go():
    bodies, solver = crowded()
    group = RoomState(obstacles=BOXES, car=CAR, size=SIZE)
    group.begin(bodies, solver, 1)
    bodies.tick[1] = 7
    group.move(bodies, solver, 1, DT)
    assert solver.calls["ready"].tolist() == [-1, 7, -1]
    assert solver.owner[1].tolist() == [0, 1, 3, 4, 6, -1, -1, -1, -1]
    solve(bodies, solver, 1, DT)
    world = group.world
    for car, comes in ((1, False), (2, True)):
        bodies.present[1, car] = comes
        group._come_or_go(bodies, 1, car)
    group.move(bodies, solver, 1, DT)
    assert group.world is world
    assert sorted(np.nonzero(solver.car_ids[1])[0]) == [0, 2, 3]
    assert sorted(solver.owner[1][solver.owner[1] >= 0]) == [0, 2, 3, 4, 6]
    solve(bodies, solver, 1, DT)
    disconnect(solver, 1)
    assert (solver.calls["ready"] == -1).all()


def test_what_a_version_of_pymunk_has_otherwise_is_said(monkeypatch):
    monkeypatch.setitem(solver_module.LAYOUTS, "pmIntArray", (8, {"num": 0}))
    private, unknown = solver_module._find_or_say_why()
    assert private is None
    assert unknown.startswith(f"pymunk {pymunk.version}: expected pmIntArray of 8 bytes")
