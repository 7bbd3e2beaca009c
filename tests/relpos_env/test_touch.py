"""Contacts: declared restitution and friction, floor friction of boxes, single counting."""

from dataclasses import replace

import numpy as np
import pytest

from relpos_env.scenarios import SCENARIOS, Obstacle
from relpos_env.scenarios.episode import draw_episode
from relpos_env.scenarios.life import LifeEvent
from relpos_env.sensors import ImuSimParams
from relpos_env.world.car import CarParams
from relpos_env.world.pymunk_space import (
    BOX_DENSITY,
    BOX_FRICTION,
    ELASTICITY,
    FRICTION,
    PhysicsSpace,
)
from relpos_env.world.world import World
from tracking.geometry import GRAVITY
from tracking.measurements import Kind


def swarm(scenario, start, events=()):
    """Return cars at given poses; only the given events occur."""
    group = World(scenario, len(start), 1)
    episode = draw_episode(scenario, len(start), 60.0, np.random.default_rng(0))
    episode = replace(episode, start=np.array(start), events=tuple(events))
    group.begin(0, episode, np.random.default_rng(1))
    return group


def bare_car(position, velocity, *, spins=True):
    """Return the velocity of a car without tyres after it hits the wall at x = 2.5 m."""
    space = PhysicsSpace((5.0, 5.0), (), CarParams(), np.array([0])).space
    (body,) = space.bodies
    if not spins:
        body.moment = float("inf")
    body.position, body.velocity = position, velocity
    for _ in range(200):
        space.step(0.001)
    return body.velocity


def test_walls_throw_back_and_rub_as_declared():
    back = bare_car((2.0, 0.0), (2.0, 0.0))
    assert -back.x / 2.0 == pytest.approx(ELASTICITY, abs=0.01)
    along = bare_car((2.2, -1.0), (1.0, 2.0), spins=False)
    assert (2.0 - along.y) / (1.0 - along.x) == pytest.approx(FRICTION, abs=0.01)


@pytest.mark.parametrize("side", [0.3, 0.6, 1.0])
def test_the_floor_holds_a_box_that_the_motor_cannot_push(side):
    box = Obstacle(x=0.0, y=0.0, width=side, height=side, movable=True)
    scenario = replace(SCENARIOS["open"], n_cars=2, obstacles=(box,))
    start = -(side / 2.0 + scenario.car.length / 2.0 + 0.02)
    group = swarm(scenario, [[start, 0.0, 0.0], [-4.0, -4.0, 0.0]])
    at = []
    for _ in range(200):
        group.step(np.array([[2.0, 0.0]]), np.zeros((1, 2)))
        at.append(group.boxes[0, 0, 0])
    grip = BOX_FRICTION * BOX_DENSITY * side**2 * GRAVITY
    push = scenario.car.mass * scenario.car.max_accel
    if grip > 1.5 * push:
        assert at[-1] < 0.05  # the impact at first
        assert at[-1] - at[50] < 1e-3
    else:
        assert at[-1] > 1.0


@pytest.mark.parametrize("others", ["stay", "come and go"])
def test_a_contact_that_lasts_counts_once(others):
    scenario = replace(SCENARIOS["ring-los"], n_cars=4)
    events = [
        LifeEvent(t=4.05 + 0.5 * k, car=3, what="leave")
        if k % 2 == 0
        else LifeEvent(t=4.05 + 0.5 * k, car=3, what="join", pose=(0.0, 0.0, 0.0))
        for k in range(6)
    ]
    start = [[2.0, 0.0, 0.0], [-1.0, 1.0, 0.0], [-1.0, -1.0, 0.0], [0.0, 0.0, 0.0]]
    group = swarm(scenario, start, events if others == "come and go" else ())
    n = np.zeros(4)
    for k in range(110):
        # Until the group is released it pushes at the wall; then it returns and hits again.
        speed = np.zeros((1, 4))
        speed[0, 0] = 1.0 if k < 75 or k >= 82 else -1.0
        group.step(speed, np.zeros((1, 4)))
        n += group.contacts[0]
        if k == 30:
            began = n[0]
        if k == 74:
            assert n[0] == began
    assert n[0] > began
    assert began > 0


def test_a_gyroscope_without_errors_tells_the_heading():
    """Rates and accelerations are integrated over the periods of their samples."""
    nothing = dict.fromkeys(
        ("gyr_noise", "acc_noise", "gyr_bias", "acc_bias", "gyr_drift", "acc_drift", "vibration",
         "gyr_vibration", "bits"), 0
    )  # fmt: skip
    open_floor = SCENARIOS["open"]
    scenario = replace(
        open_floor,
        n_cars=2,
        imu=ImuSimParams(**nothing),
        car=replace(open_floor.car, roll_compliance=0.0, pitch_compliance=0.0),
    )
    group = swarm(scenario, [[0.0, 0.0, 0.0], [-4.0, -4.0, 0.0]])
    heading, velocity = 0.0, np.zeros(2)
    for k in range(60):
        steering = 0.42 * np.sign(np.sin(2.0 * np.pi * k / 20.0))
        block = group.step(np.array([[2.0, 0.0]]), np.array([[steering, 0.0]])).env(0).sorted()
        imu = block.values[0, (block.kind[0] == Kind.IMU) & (block.i[0] == 0)]
        for gyr_z, forward, left in imu[:, [2, 3, 4]]:
            heading += 0.01 * gyr_z
            c, s = np.cos(heading), np.sin(heading)
            velocity += 0.01 * np.array([c * forward - s * left, s * forward + c * left])
        assert heading == pytest.approx(group.body[0, 0, 2], abs=1e-9)
        np.testing.assert_allclose(velocity, group.body[0, 0, 3:5], atol=1e-9)
