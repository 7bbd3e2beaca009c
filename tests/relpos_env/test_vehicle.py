"""Car dynamics against closed forms."""

import numpy as np
import pytest
from one_car import Car, forward

from relpos_env.errors import EnvError
from relpos_env.timing import DT
from relpos_env.world._car_kernels import (
    ACCEL,
    HEADING,
    PITCH,
    PITCH_RATE,
    RATE,
    ROLL,
    ROLL_ACCEL,
    ROLL_RATE,
    STEERING,
    VX,
    VY,
)
from relpos_env.world.car import CarParams, car_record
from tracking.geometry import GRAVITY


@pytest.mark.parametrize("front_share", [0.4, 0.52, 0.6])
@pytest.mark.parametrize("speed", [0.3, -0.3])
def test_turning_radius_is_the_kinematic_bicycles(speed, front_share):
    car = Car(CarParams(front_share=front_share)).go(speed, 0.3, 40.0)
    pos = car.trace[600:, :2]
    centre = 0.5 * (pos.max(axis=0) + pos.min(axis=0))
    radius = np.linalg.norm(pos - centre, axis=1)
    # The rear axle is on a circle of L / tan(steering); the centre of mass is l_r ahead of it.
    expected = np.hypot(0.30 / np.tan(0.3), car.params.rear_axle)
    assert radius.mean() == pytest.approx(expected, rel=0.005)
    assert np.ptp(radius) < 0.01


@pytest.mark.parametrize(("front", "rear"), [(4.95, 5.72), (4.0, 8.0), (5.72, 4.95)])
@pytest.mark.parametrize("speed", [0.5, 1.0, 2.0, 3.0])
def test_yaw_rate_gain_has_the_understeer_of_the_cornering_stiffnesses(speed, front, rear):
    params = CarParams(front_cornering=front, rear_cornering=rear, steering_rate=0.1)
    angle = 0.02
    car = Car(params).go(speed, 0.0, 3.0).go(speed, angle, 4.0)
    v = np.hypot(*car.trace[-1, [VX, VY]])
    gain = car.trace[-1, RATE] / angle
    assert gain == pytest.approx(v / (0.30 + params.understeer * v**2), rel=0.015)


@pytest.mark.parametrize("speed", [1.0, 1.5, 2.0])
def test_rear_axle_drifts_out_by_its_slip_angle(speed):
    """Sideways speed -v^2 r / (c_r g) to first order; a little more as the tyre saturates."""
    car = Car().go(speed, 0.1, 4.0)
    heading, v_x, v_y, rate = car.trace[-1, HEADING:]
    sideways = np.cos(heading) * v_y - np.sin(heading) * v_x - car.params.rear_axle * rate
    linear = -(forward(car.trace[-1]) ** 2) * rate / (car.params.rear_cornering * GRAVITY)
    assert 1.0 < sideways / linear < 1.12


def test_understeer_is_axle_load_over_stiffness():
    p = CarParams()
    front, rear = (car_record(p)[f"{end}_stiffness"] for end in ("front", "rear"))
    textbook = p.mass / 0.30 * (p.rear_axle / front - p.front_axle / rear)
    assert p.understeer == pytest.approx(textbook, rel=1e-12)


@pytest.mark.parametrize(
    ("friction", "front", "rear"), [(0.3, 4.95, 5.72), (0.5, 4.95, 5.72), (1.05, 8.0, 10.0)]
)
def test_lateral_acceleration_ends_at_the_grip(friction, front, rear):
    # Front-wheel drive slides at the front; full lock at a speed beyond the limit.
    params = CarParams(
        friction=friction, front_cornering=front, rear_cornering=rear,
        front_drive=1.0, max_speed=5.0, max_accel=4.0,
    )  # fmt: skip
    speed = 3.0 if friction < 0.8 else 5.0
    car = Car(params).go(speed, 0.0, 3.0).go(speed, 0.42, 12.0)
    v = np.hypot(car.trace[:, VX], car.trace[:, VY])
    lateral = (car.trace[:, RATE] * v)[-300:].mean()
    limit = friction * GRAVITY
    assert 0.95 * limit < lateral < limit
    assert v[-300:].mean() ** 2 * np.tan(0.42) / 0.30 > 1.3 * limit  # without slip it would be more
    heading, force = car.trace[:-1, HEADING], np.array(car.wrenches)
    across = np.cos(heading) * force[:, 1] - np.sin(heading) * force[:, 0]
    assert 0.97 * limit < across.max() / params.mass < limit


def test_top_speed_and_acceleration():
    for sign in (1.0, -1.0):
        car = Car().go(10.0 * sign, 0.0, 6.0)
        assert car.trace[-1, VX] == pytest.approx(3.0 * sign, rel=0.001)
        # Rolling resistance reduces the motor's acceleration.
        best = (sign * np.diff(car.trace[:, VX])).max() / DT
        assert best == pytest.approx(2.5 - 0.02 * GRAVITY, rel=0.01)
        assert np.abs(car.drive_trace[:, ACCEL]).max() <= 2.5


@pytest.mark.parametrize("brake", [2.5, 5.0])
def test_stopping_distance(brake):
    car = Car(CarParams(max_brake=brake)).go(2.0, 0.0, 3.0)
    begin = car.trace[-1, 0]
    car.go(0.0, 0.0, 3.0)
    a = brake + 0.02 * GRAVITY
    # The braking limit, its lag before, and the controller's exponential below brake / gain.
    slow = brake / 8.0
    expected = (2.0**2 - slow**2) / (2.0 * a) + 2.0 * 0.05 + slow / 8.0
    assert car.trace[-1, 0] - begin == pytest.approx(expected, abs=0.05)
    assert (car.trace[-1, VX:] == 0.0).all()


def test_motor_follows_a_small_step_with_its_lag():
    params = CarParams(motor_lag=0.1, speed_gain=2.0, rolling_resistance=0.0)
    accel = Car(params).go(3.0, 0.0, 1.0).drive_trace[:, ACCEL]
    # At the limit the controller commands a constant.
    assert np.argmax(accel >= 2.5 * (1.0 - np.exp(-1.0)) - 1e-9) + 1 == 10
    np.testing.assert_allclose(accel[:50], 2.5 * (1 - np.exp(-np.arange(1, 51) / 10)), rtol=1e-12)


@pytest.mark.parametrize("delay", [0.0, 0.01, 0.02, 0.07, 0.15])
def test_steering_starts_after_its_delay_and_turns_at_its_rate(delay):
    angle = Car(CarParams(steering_delay=delay)).go(0.0, 1.0, 0.5).drive_trace[:, STEERING]
    steps = np.arange(1, 51) - round(delay / DT)
    np.testing.assert_allclose(angle, np.clip(0.032 * steps, 0.0, 0.42), atol=1e-12)


def test_every_steering_command_arrives_once_and_in_order():
    car = Car(CarParams(steering_rate=1e6, max_steering=1.0, steering_delay=0.05))
    commands = np.random.default_rng(0).uniform(-1.0, 1.0, 60)
    for command in commands:
        car.step(0.0, command)
    np.testing.assert_allclose(car.drive_trace[5:, STEERING], commands[:-5], atol=1e-15)
    assert (car.drive_trace[:5, STEERING] == 0.0).all()


def test_roll_and_pitch_settle_at_compliance_times_acceleration():
    car = Car().go(1.5, 0.2, 6.0)
    lateral = car.trace[-1, RATE] * np.hypot(*car.trace[-1, [VX, VY]])
    assert lateral > 1.0  # to the left, so that the left side rises
    assert car.drive_trace[-1, ROLL] == pytest.approx(0.005 * lateral, rel=0.01)
    car = Car().go(3.0, 0.0, 3.0).go(0.0, 0.0, 0.7)
    braking = -np.diff(car.trace[-2:, VX])[0] / DT
    assert car.drive_trace[-1, PITCH] == pytest.approx(0.003 * braking, rel=0.05)
    assert car.drive_trace[20, PITCH] < 0.0  # nose up at the start
    car.go(0.0, 0.0, 5.0)
    assert (car.drive_trace[-1, ROLL : PITCH_RATE + 1] == 0.0).all()


def test_roll_swings_as_a_spring_and_damper():
    """Release at an angle: closed form of a damped oscillation, and rates as derivatives."""
    car = Car()
    car.drive[0, 0, ROLL] = 0.05
    car.go(0.0, 0.0, 0.6)
    t = DT * np.arange(1, 61)
    w, z = 2 * np.pi * 5.0, 0.4
    wd = w * np.sqrt(1 - z**2)
    swing = 0.05 * np.exp(-z * w * t) * (np.cos(wd * t) + z * w / wd * np.sin(wd * t))
    roll, rate, accel = car.drive_trace[:, [ROLL, ROLL_RATE, ROLL_ACCEL]].T
    np.testing.assert_allclose(roll, swing, atol=0.05 * 0.01)
    np.testing.assert_allclose(np.diff(roll) / DT, 0.5 * (rate[1:] + rate[:-1]), atol=1e-12)
    np.testing.assert_allclose(np.diff(rate) / DT, accel[1:], atol=1e-11)


@pytest.mark.parametrize("heading", np.linspace(-np.pi, np.pi, 13))
def test_stays_where_it_stands(heading):
    start = (1.3, -2.7, heading, 0.0, 0.0, 0.0)
    car = Car(body=start).go(0.0, 0.3, 3.0)
    assert (car.trace == np.array(start)).all()
    car.go(0.8, 0.3, 1.0).go(0.0, -0.3, 1.0)
    stop = car.body.copy()
    car.go(0.0, 0.3, 5.0)
    assert (car.body[0, 0, :3] == stop[0, 0, :3]).all()
    assert (car.body[0, 0, VX:] == 0.0).all()


def test_creeps_as_slowly_as_it_is_told():
    for speed in (0.01, -0.01):
        car = Car().go(speed, 0.2, 4.0)
        assert forward(car.trace[-1]) == pytest.approx(speed, rel=0.01)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"mass": 0.0}, "mass: expected a positive number"),
        ({"friction": np.nan}, "friction: expected a positive number"),
        ({"rolling_resistance": -0.1}, "rolling_resistance: expected 0 or more"),
        ({"front_share": 1.0}, r"front_share: expected within \(0, 1\)"),
        ({"front_drive": 1.1}, "front_drive: expected 0 to 1"),
        ({"max_steering": 1.6}, "max_steering: expected below pi/2"),
        ({"steering_delay": 0.2}, "steering_delay: expected at most 0.15 s"),
    ],
)
def test_impossible_cars_are_named(wrong, message):
    with pytest.raises(EnvError, match=message):
        CarParams(**wrong)
