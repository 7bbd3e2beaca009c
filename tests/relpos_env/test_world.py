"""Collisions, pushed boxes and line of sight; no car passes a wall."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from runs import drive, placed

from relpos_env.scenarios.rooms.obstacle import Obstacle
from relpos_env.scenarios.rooms.overlap import beyond_walls, car_boxes
from relpos_env.world.car import CarParams
from tracking.measurements import Kind

CAR = CarParams()
FAR_AWAY = (3.5, 3.5, 0.0)
LIGHT = Obstacle(x=0.0, y=0.0, width=0.3, height=0.3, movable=True)
DEPTH = 0.03
"""[m] Penetration that the solver allows at 2 m/s."""


def test_cars_collide():
    swarm = placed([(-1.5, 0.0, 0.0), (1.5, 0.02, np.pi)])
    contacts = drive(swarm, 4.0, 1.0)
    assert (contacts > 0).all()
    gap = np.linalg.norm(np.diff(swarm.state.pos_w[0], axis=0))
    assert gap > CAR.length - DEPTH


def test_a_wall_stops_a_car():
    swarm = placed([(0.0, 0.0, 0.0), (*FAR_AWAY[:2], np.pi)])
    contacts = drive(swarm, 6.0, [1.5, 0.0])
    assert contacts[0] > 0
    assert contacts[1] == 0
    front = swarm.state.pos_w[0, 0, 0] + 0.5 * CAR.length
    assert front == pytest.approx(4.0, abs=DEPTH + 0.02)


def test_a_box_that_stands_stops_a_car_and_stays():
    box = Obstacle(x=1.0, y=0.0, width=0.3, height=1.0)
    swarm = placed([(-1.0, 0.0, 0.0), FAR_AWAY], obstacles=[box])
    before = swarm.boxes.copy()
    contacts = drive(swarm, 3.0, [1.5, 0.0])
    assert contacts.tolist()[1] == 0
    assert contacts[0] > 0
    assert swarm.state.pos_w[0, 0, 0] + 0.5 * CAR.length < 0.85 + DEPTH
    assert np.array_equal(swarm.boxes, before)


def test_a_box_that_can_be_pushed_comes_to_rest_and_hides_there():
    swarm = placed([(-1.0, 0.0, 0.0), (1.4, -2.0, 0.0), (1.4, 2.0, 0.0)], obstacles=[LIGHT])
    assert swarm.line_of_sight(0)[1, 2]
    for _ in range(100):
        drive(swarm, 0.1, [1.0, 0.0, 0.0])
        if swarm.boxes[0, 0, 0] > 1.15:
            break
    drive(swarm, 2.0, [-1.0, 0.0, 0.0])
    body = swarm._bodies.box_body[0, 0]
    assert swarm.boxes[0, 0, 0] == pytest.approx(1.4, abs=0.14)
    assert not body[3:].any()
    at_rest = body.copy()
    drive(swarm, 1.0, 0.0)
    assert np.array_equal(body, at_rest)
    assert not swarm.line_of_sight(0)[1, 2]
    assert swarm.line_of_sight(0)[0, 1]
    events = swarm.events
    ranges = events.valid[0] & (events.kind[0] == Kind.RANGE)
    ends = np.sort(np.stack([events.i[0], events.j[0]]), axis=0)
    hidden = ranges & (ends[0] == 1) & (ends[1] == 2)
    assert hidden.any()
    assert events.nlos[0, hidden].all()
    assert not events.nlos[0, ranges & ~hidden].any()


def test_a_pushed_box_stays_in_the_room():
    swarm = placed([(-1.0, 0.0, 0.0), FAR_AWAY], room=(6.0, 8.0), obstacles=[LIGHT])
    drive(swarm, 8.0, [2.0, 0.0])
    assert swarm.boxes[0, 0, 0] < 3.0


def test_a_car_that_is_taken_out_is_in_nobodys_way():
    swarm = placed([(-1.0, 0.0, 0.0), (0.5, 0.0, 0.0)])
    swarm._bodies.present[0, 1] = False
    swarm._groups[0].world.remove_car(1)
    assert not drive(swarm, 2.0, [1.0, 0.0]).any()
    assert swarm.state.pos_w[0, 0, 0] > 0.4


def test_line_of_sight():
    box = Obstacle(x=0.0, y=0.0, width=1.0, height=1.0)
    swarm = placed([(-2.0, 0.0, 0.0), (2.0, 0.0, 0.0), (-2.0, 2.0, 0.0)], obstacles=[box])
    sight = [[True, False, True], [False, True, True], [True, True, True]]
    assert swarm.line_of_sight(0).tolist() == sight


SMALL = (2.0, 1.6)
STARTS = [(-0.5, 0.4, 0.0), (0.5, 0.4, np.pi), (0.0, -0.4, 0.5)]
BOXES = [
    Obstacle(x=0.0, y=0.1, width=0.2, height=0.2, angle=0.4, movable=True),
    Obstacle(x=0.7, y=-0.5, width=0.2, height=0.2),
]
HARD_TURNS = st.lists(
    st.tuples(*3 * [st.sampled_from([-3.0, -1.0, 0.0, 2.0, 3.0])], st.floats(-0.42, 0.42)),
    min_size=4,
    max_size=12,
)


@settings(max_examples=25, suppress_health_check=list(HealthCheck))
@given(HARD_TURNS)
def test_nobody_gets_through_a_wall(turns):
    swarm = placed(STARTS, room=SMALL, obstacles=BOXES)
    for *speeds, steering in turns:
        drive(swarm, 0.5, speeds, steering)
        state = swarm.state
        poses = np.column_stack([state.pos_w[0], state.heading[0]])
        outer = np.array(SMALL) + 2.0 * DEPTH
        assert not beyond_walls(car_boxes(poses, CAR), tuple(outer)).any()
        inside = np.abs(swarm.boxes[0, 0, :2]) < 0.5 * np.array(SMALL)
        assert inside.all()
        assert np.isfinite(swarm._bodies.body).all()
