"""IMUs, magnetometers and odometers of the batch: exact without errors, errors as specified."""

from dataclasses import fields, replace

import numpy as np
import pytest

from relpos_env.sensors._imu_kernels import STARTS, felt_on_car, read_imu, start_imus
from relpos_env.sensors._magnetometer_kernels import (
    N_WAVE,
    read_magnetometer,
    start_magnetometers,
)
from relpos_env.sensors._odometer_kernels import read_odometers
from relpos_env.sensors.imu import IMU, ImuSimParams, fill_imu
from relpos_env.sensors.magnetometer import MAG, MagSimParams, fill_mag
from relpos_env.sensors.odometer import ODOMETER, OdometerSimParams
from relpos_env.simulation.recorder import quat_from_tilt
from relpos_env.world.parameter_records import fill_numbers
from tracking.geometry import GRAVITY, quat_conjugate, quat_from_yaw, quat_multiply, rotate
from tracking.maths.elementary import cosine_sine
from tracking.records import as_records

SEED = np.uint64(7)
KEPT = ("drift_tau", "vibration_speed", "gyr_range", "acc_range")
EXACT = ImuSimParams(**{f.name: 0 for f in fields(ImuSimParams) if f.name not in KEPT})


class Imus:
    """n IMUs of one environment."""

    def __init__(self, params, n=1, seed=SEED):
        records = np.zeros(1, dtype=IMU)
        fill_imu(records[0], params, 0.01)
        self.p, self.seed = as_records(records)[0], seed
        self.bias, self.drift = np.zeros((1, n, 6)), np.zeros((1, n, 6))
        start_imus(self.p, seed, self.bias, self.drift, 0)

    def read(self, count, truth=(0.0,) * 6, speed=0.0):
        out = np.zeros((1, self.bias.shape[1], 7))
        for n in range(self.bias.shape[1]):
            at = (self.p, self.seed, count, self.bias, self.drift, 0, n)
            read_imu(*at, tuple(truth), speed, out, n)
        return out[0, :, :6]


def tilted(roll, pitch):
    return quat_from_tilt(np.array(roll), np.array(pitch))


@pytest.mark.parametrize(("roll", "pitch"), [(0.0, 0.0), (0.1, 0.0), (0.0, -0.2), (0.3, 0.25)])
def test_specific_force_has_gravity_in_it_by_roll_and_pitch(roll, pitch):
    forward, left = 1.3, -0.7
    force = felt_on_car(0.4, forward, left, *map(cosine_sine, (roll, pitch)), 0.0, 0.0)[3:]
    level = np.array([forward, left, GRAVITY])
    np.testing.assert_allclose(
        force, rotate(quat_conjugate(tilted(roll, pitch)), level), atol=1e-12
    )


def test_angular_rate_is_the_derivative_of_the_orientation():
    """Yaw, then pitch, then roll, all three rotating; finite differences of the quaternion."""
    rates = {"yaw": 0.7, "roll": -0.4, "pitch": 0.3}

    def q(t):
        yaw, roll, pitch = 0.5 + rates["yaw"] * t, 0.2 + rates["roll"] * t, rates["pitch"] * t - 0.1
        return quat_multiply(quat_from_yaw(yaw), tilted(roll, pitch))

    h = 1e-5
    turn = 2.0 * quat_multiply(quat_conjugate(q(0.0)), (q(h) - q(-h)) / (2.0 * h))
    lean = (cosine_sine(0.2), cosine_sine(-0.1))
    felt = felt_on_car(rates["yaw"], 0.0, 0.0, *lean, rates["roll"], rates["pitch"])[:3]
    np.testing.assert_allclose(felt, turn[1:], atol=1e-9)


def test_an_imu_without_errors_gives_the_truth():
    truth = (0.1, -0.2, 0.3, 1.0, -2.0, 9.8)
    readings = np.array([Imus(EXACT).read(k, truth, speed=2.0) for k in range(30)])
    np.testing.assert_array_equal(readings, np.broadcast_to(truth, readings.shape))


def test_an_imu_ends_at_its_range_in_its_steps():
    imus = Imus(replace(EXACT, bits=16))
    np.testing.assert_allclose(imus.read(1, (99.0,) * 6)[0], [34.9] * 3 + [78.5] * 3)
    np.testing.assert_allclose(imus.read(1, (-99.0,) * 6)[0], [-34.9] * 3 + [-78.5] * 3)
    readings = Imus(ImuSimParams(), 50).read(3, (0.1,) * 6)
    steps = readings / (np.repeat([34.9, 78.5], 3) / 2**15)
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-6)


@pytest.mark.parametrize("speed", [0.0, 0.5, 3.0])
def test_imu_noise_grows_with_speed_to_what_is_asked(speed):
    noisy = replace(EXACT, gyr_noise=0.01, acc_noise=0.2, gyr_vibration=0.02, vibration=0.5)
    imus = Imus(noisy, 3)
    x = np.array([imus.read(k, speed=speed) for k in range(1, 3001)]).reshape(-1, 6)
    share = min(speed, 1.0)
    std = np.repeat([np.hypot(0.01, 0.02 * share), np.hypot(0.2, 0.5 * share)], 3)
    np.testing.assert_allclose(x.std(axis=0), std, rtol=0.05)
    assert (np.abs(x.mean(axis=0)) < 4.0 * std / np.sqrt(len(x))).all()
    assert np.abs(np.corrcoef(x.T) - np.eye(6)).max() < 0.06
    lag = (x.reshape(3000, 3, 6)[1:] * x.reshape(3000, 3, 6)[:-1]).mean(axis=(0, 1)) / std**2
    assert np.abs(lag).max() < 0.06


def test_imu_biases_are_as_large_as_asked_and_the_slow_part_stays_so():
    p = replace(EXACT, gyr_bias=0.01, acc_bias=0.3, gyr_drift=0.004, acc_drift=0.1, drift_tau=2.0)
    imus = Imus(p, 800)
    expected = np.repeat([0.01, 0.3], 3)
    np.testing.assert_allclose(imus.bias[0].std(axis=0), expected, rtol=0.1)
    before = imus.drift[0].copy()
    slow = np.repeat([0.004, 0.1], 3)
    np.testing.assert_allclose(before.std(axis=0), slow, rtol=0.1)
    for count in range(1, 201):
        imus.read(count)
    np.testing.assert_allclose(imus.drift[0].std(axis=0), slow, rtol=0.1)
    # Over one time constant it decays to 1 / e.
    kept = (before * imus.drift[0]).mean(axis=0) / slow**2
    np.testing.assert_allclose(kept, np.exp(-1.0), atol=0.12)


class Magnetometers:
    """n magnetometers in one room."""

    def __init__(self, params, n=1, seed=SEED):
        records = np.zeros(1, dtype=MAG)
        fill_mag(records[0], params)
        self.p, self.seed = as_records(records)[0], seed
        self.waves, self.hard_iron = np.zeros((1, 6, N_WAVE)), np.zeros((1, n, 3))
        start_magnetometers(self.p, seed, self.waves, self.hard_iron, 0)

    def read(self, count=1, at=(0.0, 0.0), heading=0.0, roll=0.0, pitch=0.0):
        n = self.hard_iron.shape[1]
        out = np.zeros((1, n, 7))
        for k in range(n):
            where = (self.p, self.seed, count, self.waves, self.hard_iron, 0, k)
            read_magnetometer(*where, at, *map(cosine_sine, (heading, roll, pitch)), out, k)
        return out[0, :, :3]


QUIET = MagSimParams(disturbance=0.0, hard_iron=0.0, noise=0.0, bits=0)


@pytest.mark.parametrize(("roll", "pitch"), [(0.0, 0.0), (0.2, 0.0), (0.0, 0.3), (-0.3, 0.25)])
def test_a_magnetometer_without_errors_gives_the_field_in_its_frame(roll, pitch):
    q = quat_multiply(quat_from_yaw(0.8), tilted(roll, pitch))
    field = rotate(quat_conjugate(q), np.array(QUIET.field_w))
    read = Magnetometers(QUIET).read(heading=0.8, roll=roll, pitch=pitch)
    np.testing.assert_allclose(read[0], field, atol=1e-12)


def test_the_field_of_a_building_is_as_strong_as_asked_and_the_same_for_all():
    bent = replace(QUIET, disturbance=3.0)
    fields_w = []
    for seed in range(40):
        mags = Magnetometers(bent, 2, np.uint64(seed))
        for at in np.random.default_rng(seed).uniform(-20.0, 20.0, (20, 2)):
            both = mags.read(at=tuple(at))
            assert np.array_equal(both[0], both[1])
            fields_w.append(both[0] - QUIET.field_w)
    np.testing.assert_allclose(np.std(fields_w, axis=0), 3.0, rtol=0.15)
    near = mags.read(at=(1.0, 1.0)) - mags.read(at=(1.01, 1.0))
    assert np.abs(near).max() < 0.2


def test_magnetometer_noise_and_hard_iron_are_as_asked():
    mags = Magnetometers(replace(QUIET, noise=0.4, hard_iron=0.5), 400)
    x = np.array([mags.read(k) for k in range(1, 41)]) - QUIET.field_w
    np.testing.assert_allclose(x.mean(axis=0).std(axis=0), np.hypot(0.5, 0.4 / 40**0.5), rtol=0.1)
    np.testing.assert_allclose((x - x.mean(axis=0)).std(axis=(0, 1)), 0.4, rtol=0.05)


def odometers(params, speed, ticks, n=400):
    records = np.zeros(1, dtype=ODOMETER)
    fill_numbers(records[0], params)
    body = np.zeros((1, n, 6))
    body[0, :, 2] = 0.7
    body[0, :, 3:5] = speed * np.array([np.cos(0.7), np.sin(0.7)])
    present = np.arange(n)[None] != 1
    out, rows = np.zeros((1, n)), []
    for tick in ticks:
        seeds = np.array([SEED])
        read_odometers(as_records(records), seeds, np.array([tick]), body, present, out)
        rows.append(out[0].copy())
    return np.array(rows)


def test_odometers():
    exact = odometers(OdometerSimParams(scale_std=0.0, noise=0.0), 1.5, [1])[0]
    np.testing.assert_allclose(np.delete(exact, 1), 1.5, atol=1e-12)
    assert exact[1] == 0.0
    x = np.delete(odometers(OdometerSimParams(scale_std=0.05, noise=0.02), 2.0, range(50)), 1, 1)
    np.testing.assert_allclose(x.mean(axis=0).std(), 0.1, rtol=0.1)
    np.testing.assert_allclose((x - x.mean(axis=0)).std(), 0.02, rtol=0.05)


def test_same_seed_same_stream():
    for kind, params in ((Imus, ImuSimParams()), (Magnetometers, MagSimParams())):
        one, two, other = (kind(params, 3, np.uint64(seed)) for seed in (1, 1, 2))
        for count in (1, 10, 11, STARTS - 1):
            readings = [each.read(count) for each in (one, two, other)]
            assert np.array_equal(readings[0], readings[1])
            assert not np.array_equal(readings[0], readings[2])
