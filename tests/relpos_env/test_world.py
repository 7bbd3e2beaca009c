"""Cars against closed forms, sensors against their laws."""

from dataclasses import replace

import numpy as np
import pytest

from relpos_env.drivers import LoopDrivers
from relpos_env.errors import EnvError
from relpos_env.interface.actions import DriveCommand
from relpos_env.scenarios import SCENARIOS, scenario
from relpos_env.sensors import Imu, ImuSimParams, Magnetometer, MagSimParams, RadioSimParams
from relpos_env.sensors.radio.channel import EXACT
from relpos_env.sim import DT, Simulation
from relpos_env.vehicle import CarParams
from relpos_env.world import Obstacle, World
from tracking.geometry import GRAVITY
from tracking.measurements import Kind

BIG = (60.0, 60.0)


def drive(speed, steering, seconds, start=(0.0, 0.0, 0.0), car=None, **kwargs):
    world = World(BIG, (), car or CarParams(), np.array([start]))
    command = DriveCommand(0.0, np.array([speed]), np.array([steering]))
    return world, [world.step(command, DT) for _ in range(round(seconds / DT))]


def test_turning_radius_is_the_bicycles():
    world, states = drive(0.8, 0.3, 12.0)
    pos = np.array([s.pos_w[0] for s in states[600:]])
    centre = 0.5 * (pos.max(axis=0) + pos.min(axis=0))
    radius = np.linalg.norm(pos - centre, axis=1).mean()
    # The centre of mass stands half a wheelbase before the rear axle.
    expected = np.hypot(0.30 / np.tan(0.3), 0.15)
    assert radius == pytest.approx(expected, rel=0.02)


def test_top_speed_and_acceleration():
    _, states = drive(10.0, 0.0, 4.0)
    assert states[-1].speed[0] == pytest.approx(CarParams().max_speed, rel=0.01)
    accel = [s.accel_w[0, 0] for s in states]
    assert max(accel) == pytest.approx(CarParams().max_accel, rel=0.01)


def test_grip_limits_the_lateral_acceleration():
    _, states = drive(3.0, 0.4, 6.0)
    lateral = [abs(s.yaw_rate[0] * s.speed[0]) for s in states[200:]]
    assert max(lateral) < 1.2 * CarParams().friction * GRAVITY
    kinematic = 3.0**2 / (0.30 / np.tan(0.4))
    assert kinematic > CarParams().friction * GRAVITY  # it must have slid


def test_braking_distance():
    world, _ = drive(2.0, 0.0, 3.0)
    begin = world.state.pos_w[0, 0]
    stop = DriveCommand(0.0, np.zeros(1), np.zeros(1))
    for _ in range(300):
        world.step(stop, DT)
    # Braking at the limit, then the controller's exponential tail: v^2 / 2a and a little.
    distance = world.state.pos_w[0, 0] - begin
    assert 2.0**2 / (2 * 2.5) < distance < 2.0**2 / (2 * 2.5) + 0.08


def test_walls_and_cars_collide():
    world = World((4.0, 4.0), (), CarParams(), np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, np.pi]]))
    command = DriveCommand(0.0, np.array([1.0, 1.0]), np.zeros(2))
    for _ in range(300):
        world.step(command, DT)
    assert (world.n_collisions > 0).all()
    gap = np.linalg.norm(world.state.pos_w[1] - world.state.pos_w[0])
    assert gap > 0.9 * CarParams().length


def test_line_of_sight():
    box = Obstacle(x=0.0, y=0.0, width=1.0, height=1.0)
    world = World((8.0, 8.0), (box,), CarParams(), np.array([[-3.0, 3.0, 0.0]]))
    assert not world.line_of_sight(np.array([-2.0, 0.0]), np.array([2.0, 0.0]))
    assert world.line_of_sight(np.array([-2.0, 1.0]), np.array([2.0, 1.0]))


def test_perfect_sensors_give_the_truth():
    none = {
        "gyr_noise": 0, "acc_noise": 0, "gyr_bias": 0, "acc_bias": 0, "gyr_drift": 0,
        "acc_drift": 0, "vibration": 0, "gyr_vibration": 0, "bits": 0,
    }  # fmt: skip
    imu = Imu(ImuSimParams(**none), 1, np.random.default_rng(0))
    reading = imu.sample(np.array([np.pi / 2]), np.array([0.4]), np.array([[0.0, 2.0]]), np.ones(1))
    np.testing.assert_allclose(reading[0], [0, 0, 0.4, 2.0, 0, GRAVITY], atol=1e-12)
    quiet = MagSimParams(disturbance=0, hard_iron=0, noise=0, bits=0)
    mag = Magnetometer(quiet, 1, np.random.default_rng(0))
    field = mag.sample(np.zeros((1, 2)), np.array([np.pi / 2]))
    np.testing.assert_allclose(field[0], [20.0, 0.0, -43.0], atol=1e-12)


def test_imu_noise_bias_and_resolution_are_as_asked():
    params = ImuSimParams(vibration=0, gyr_vibration=0)
    imu = Imu(params, 400, np.random.default_rng(1))
    still = np.zeros(400)
    samples = np.array([imu.sample(still, still, np.zeros((400, 2)), still) for _ in range(200)])
    bias = samples.mean(axis=0)
    np.testing.assert_allclose(bias[:, 3].std(), np.hypot(0.03, 0.01), rtol=0.15)
    np.testing.assert_allclose(bias[:, 0].std(), np.hypot(3.5e-3, 8.7e-4), rtol=0.15)
    noise = (samples - bias).std()
    assert noise > 0.0
    step = 78.5 / 2**15
    multiples = samples[..., 3:] / step
    np.testing.assert_allclose(multiples, np.round(multiples), atol=1e-6)


def ranges(sim_scenario, seconds=20.0, seed=2):
    sim = Simulation(sim_scenario, np.random.default_rng(seed), record=True)
    drivers = LoopDrivers(sim_scenario, sim.driver_rng)
    for _ in range(round(seconds * 10)):
        sim.step(drivers.command(sim.state))
    return sim.to_log("x")


def errors(log):
    chosen = log.block.kind[0] == Kind.RANGE
    t = log.block.t[0, chosen]
    pos, known = log.truth.positions(log.constellation, t)
    rows = np.arange(len(t))
    i, j = log.block.i[0, chosen], log.block.j[0, chosen]
    true = np.linalg.norm(pos[rows, j] - pos[rows, i], axis=1)
    ok = known[rows, i] & known[rows, j]
    return (log.block.values[0, chosen, 0] - true)[ok], log.nlos[ok]


def test_ranges_come_at_the_rate_of_the_protocol_with_the_errors_of_the_place():
    log = ranges(scenario("cars-nlos"), seconds=60.0)
    e, nlos = errors(log)
    assert 0.05 < nlos.mean() < 0.6
    # Errors are correlated over metres, so that a minute has few independent ones.
    assert e[~nlos].std() == pytest.approx(0.06, rel=0.3)
    assert e[~nlos].mean() == pytest.approx(0.0, abs=0.04)
    assert 0.03 < e[nlos].mean() < 0.25
    exact = ranges(replace(scenario("cars-los"), radio=RadioSimParams(channel=EXACT)))
    rounds = exact.n_ranges / 3 / (20.0 - exact.t_range[0])
    assert rounds == pytest.approx(80.6, rel=0.01)
    assert np.abs(errors(exact)[0]).max() < 0.008


def test_recordings_to_calibrate_with_have_the_sum_of_both_antennas_in_every_range():
    delays = replace(RadioSimParams(channel=EXACT), antenna_delay_std=0.2)
    log = ranges(replace(scenario("cars-los"), radio=delays))
    e, _ = errors(log)
    chosen = log.block.kind[0] == Kind.RANGE
    ends = log.block.i[0, chosen], log.block.j[0, chosen]
    e = e[: len(ends[0])]
    pairs = {
        (i, j): e[(ends[0][: len(e)] == i) & (ends[1][: len(e)] == j)]
        for i, j in ((0, 1), (0, 2), (1, 2))
    }
    assert all(np.ptp(values) < 0.02 for values in pairs.values())
    assert max(abs(values.mean()) for values in pairs.values()) > 0.05


def test_more_cars_than_a_short_frame_has_rows_for():
    many = replace(scenario("ring-los"), name="big", room=(30.0, 30.0), ring=(8.0, 8.0), n_cars=18)
    log = ranges(many, seconds=6.0)
    heard = {(int(i), int(j)) for i, j in zip(log.block.i[0], log.block.j[0], strict=True)}
    assert sum(i != j for i, j in heard) == 18 * 17 / 2


@pytest.mark.parametrize("name", SCENARIOS)
def test_same_seed_same_recording(name):
    a, b = (ranges(scenario(name), seconds=3.0, seed=9) for _ in range(2))
    np.testing.assert_array_equal(a.block.values, b.block.values)
    np.testing.assert_array_equal(a.truth.pos_w, b.truth.pos_w)
    other = ranges(scenario(name), seconds=3.0, seed=10)
    assert not np.array_equal(a.truth.pos_w, other.truth.pos_w)


def test_impossible_numbers_of_cars():
    with pytest.raises(EnvError, match="cars: expected at least 2"):
        replace(scenario("cars-los"), n_cars=1)
    with pytest.raises(EnvError, match="cars: 50 do not fit"):
        replace(scenario("cars-los"), n_cars=50)
