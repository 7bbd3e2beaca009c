"""Properties of the car: energy, grip, mirror, differential equation, pymunk body, batches."""

import numpy as np
import pymunk
import pymunk.batch
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from one_car import Car, forward
from scipy.integrate import solve_ivp

from relpos_env.timing import DT
from relpos_env.world._car_kernels import (
    ACCEL,
    HEADING,
    N_DRIVE,
    RATE,
    STEERING,
    VX,
    VY,
    drive_cars,
    integrate_cars,
)
from relpos_env.world.car import CarParams, car_record
from tracking.geometry import GRAVITY

state = st.tuples(
    st.floats(-4.0, 4.0), st.floats(-4.0, 4.0), st.floats(-4.0, 4.0), st.floats(-12.0, 12.0)
)
some_car = st.builds(
    CarParams,
    mass=st.floats(1.5, 3.5),
    length=st.floats(0.2, 0.8),
    wheelbase=st.floats(0.2, 0.4),
    front_share=st.floats(0.2, 0.8),
    friction=st.floats(0.1, 2.0),
    front_cornering=st.floats(2.0, 30.0),
    rear_cornering=st.floats(2.0, 30.0),
    front_drive=st.floats(0.0, 1.0),
    max_brake=st.floats(0.5, 20.0),
    rolling_resistance=st.floats(0.0, 0.2),
)


@settings(max_examples=150)
@given(some_car, state, st.floats(-0.42, 0.42), st.sampled_from([0.1, 1.0]))
def test_tyres_and_brakes_only_take_energy(params, start, steering, scale):
    """From any slide, at every step, to standstill."""
    car = Car(params, body=(0.0, 0.0, *(scale * np.array(start))))
    car.drive[0, 0, STEERING] = steering
    for _ in range(60):
        before = car.energy()
        car.step(0.0, steering)
        assert car.energy() <= before * (1.0 + 1e-12)
    if params.friction > 0.5 and params.max_brake > 2.0 and params.rolling_resistance > 0.01:
        car.go(0.0, steering, 8.0)
        assert car.energy() == 0.0


@settings(max_examples=100)
@given(some_car, state, st.floats(-3.0, 3.0), st.floats(-0.42, 0.42))
def test_the_floor_gives_no_more_than_the_grip(params, start, speed, steering):
    car = Car(params, body=(0.0, 0.0, *start)).go(speed, steering, 0.3)
    force = np.hypot(*np.array(car.wrenches)[:, :2].T)
    assert force.max() <= params.friction * params.mass * GRAVITY * (1.0 + 1e-12)


@settings(max_examples=50)
@given(state, st.floats(-3.0, 3.0), st.floats(-0.42, 0.42))
def test_mirrored_commands_give_mirrored_motion(start, speed, steering):
    mirror = np.array([1.0, -1.0, -1.0, 1.0, -1.0, -1.0])
    body = np.array([0.0, 0.0, *start])
    left = Car(body=body).go(speed, steering, 0.5).trace
    right = Car(body=body * mirror).go(speed, -steering, 0.5).trace
    np.testing.assert_array_equal(left, right * mirror)


def equations(p):
    """Return the bicycle model as an ODE in v_x, v_y, yaw rate, with tyres by slip angle."""

    def tyre(slip, load, cornering, along):
        most = np.sqrt((p.friction * load) ** 2 - along**2)
        z = min(1.0, cornering * load * abs(slip) / (3.0 * most))
        return -np.sign(slip) * most * (1.0 - (1.0 - z) ** 3)

    def rates(t, y, angle, motor):
        v_x, v_y, r, heading = y[:4]
        a, b = p.front_axle, p.rear_axle
        loads = np.array([p.front_share, 1.0 - p.front_share]) * p.mass * GRAVITY
        turned = np.arctan2(v_y + a * r, v_x) - angle(t)
        drive = 0.5 * p.mass * motor(t)
        front = tyre(np.tan(turned), loads[0], p.front_cornering, drive)
        rear = tyre((v_y - b * r) / v_x, loads[1], p.rear_cornering, drive)
        c, s = np.cos(angle(t)), np.sin(angle(t))
        side = front * c + drive * s
        f_x, f_y = drive + drive * c - front * s, rear + side
        return [
            f_x / p.mass + r * v_y, f_y / p.mass - r * v_x, (a * side - b * rear) / p.inertia, r,
            np.cos(heading) * v_x - np.sin(heading) * v_y,
            np.sin(heading) * v_x + np.cos(heading) * v_y,
        ]  # fmt: skip

    return rates


@pytest.mark.parametrize(("dt", "tolerance"), [(0.01, 0.05), (0.001, 0.005)])
def test_a_slalom_is_that_of_the_differential_equation(dt, tolerance):
    params = CarParams(rolling_resistance=0.0, steering_delay=0.0, max_accel=1.0)
    car = Car(params, body=(0.0, 0.0, 0.0, 1.2, 0.0, 0.0), dt=dt)
    angles, motors = [], []
    for k in range(round(1.5 / dt)):
        car.step(3.0, 0.3 * np.sin(6.0 * k * dt))
        angles.append(car.drive[0, 0, STEERING])
        motors.append(car.drive[0, 0, ACCEL])
    t = dt * np.arange(len(angles))
    end = solve_ivp(
        equations(params),
        (0.0, 1.5),
        [1.2, 0.0, 0.0, 0.0, 0.0, 0.0],
        args=(lambda x: np.interp(x, t, angles), lambda x: np.interp(x, t, motors)),
        rtol=1e-7,
        max_step=0.01,
    ).y[:, -1]
    body = car.trace[-1]
    assert np.ptp(car.trace[:, RATE]) > 3.0  # it is a slalom
    np.testing.assert_allclose(body[:2], end[4:6], atol=tolerance)
    np.testing.assert_allclose(body[HEADING], end[3], atol=tolerance)
    np.testing.assert_allclose(forward(body), end[0], atol=tolerance)


def test_integration_is_pymunks_bit_for_bit():
    rng = np.random.default_rng(5)
    params = CarParams(mass=2.3)
    space = pymunk.Space()
    bodies = [pymunk.Body(params.mass, params.inertia) for _ in range(3)]
    mine = rng.normal(size=(1, 3, 6))
    for body, row in zip(bodies, mine[0], strict=True):
        body.position, body.angle = tuple(row[:2]), row[HEADING]
        body.velocity, body.angular_velocity = tuple(row[VX : VY + 1]), row[RATE]
    space.add(*bodies)
    fields = pymunk.batch.BodyFields
    read = fields.POSITION | fields.ANGLE | fields.VELOCITY | fields.ANGULAR_VELOCITY
    cars = car_record(params).reshape(1)
    inbox, outbox = pymunk.batch.Buffer(), pymunk.batch.Buffer()
    wrench = np.zeros((1, 3, 3))
    outbox.set_float_buf(wrench)
    drive, present = np.zeros((1, 3, N_DRIVE)), np.ones((1, 3), dtype=bool)
    for k in range(500):
        command = rng.uniform(-3.0, 3.0, (1, 3)), rng.uniform(-0.4, 0.4, (1, 3))
        drive_cars(cars, mine, drive, present, *command, DT, wrench)
        pymunk.batch.set_space_bodies(space, fields.FORCE | fields.TORQUE, outbox)
        space.step(DT)
        integrate_cars(cars, mine, present, wrench, DT)
        inbox.clear()
        pymunk.batch.get_space_bodies(space, read, inbox)
        theirs = np.frombuffer(inbox.float_buf(), dtype=np.float64).reshape(-1, 6)
        np.testing.assert_array_equal(theirs[:3], mine[0], err_msg=f"step {k}")


def test_cars_of_a_batch_are_those_alone_and_the_absent_stand():
    rng = np.random.default_rng(6)
    params = [CarParams(mass=m, friction=f) for m, f in ((1.5, 0.4), (3.0, 1.2))]
    cars = np.array([car_record(p) for p in params])
    body = rng.normal(size=(2, 3, 6))
    start = body.copy()
    drive, wrench = np.zeros((2, 3, N_DRIVE)), np.ones((2, 3, 3))
    present = np.array([[True, False, True], [True, True, False]])
    alone = {(e, n): Car(params[e], start[e, n]) for e, n in np.argwhere(present)}
    for _ in range(100):
        speed, angle = rng.uniform(-3.0, 3.0, (2, 3)), rng.uniform(-0.4, 0.4, (2, 3))
        drive_cars(cars, body, drive, present, speed, angle, DT, wrench)
        integrate_cars(cars, body, present, wrench, DT)
        for (e, n), car in alone.items():
            car.step(speed[e, n], angle[e, n])
    for (e, n), car in alone.items():
        np.testing.assert_array_equal(body[e, n], car.body[0, 0])
        np.testing.assert_array_equal(drive[e, n], car.drive[0, 0])
    assert (wrench[~present] == 0.0).all()
    assert (drive[~present] == 0.0).all()
    np.testing.assert_array_equal(body[~present], start[~present])
