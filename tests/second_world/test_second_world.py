"""The second world is independent of the simulator, and its sensors obey their models."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from tests.second_world.motion import drive
from tests.second_world.record import matched, record
from tests.second_world.sensors import G, read_imu, read_ranges
from tests.second_world.world import draw
from tracking.measurements import Kind

T = np.arange(0.5, 19.5, 0.01)


@pytest.fixture(scope="module")
def world():
    return draw(3, seconds=20.0, long_share=0.1)


@pytest.fixture(scope="module")
def motions(world):
    return drive(world, np.random.default_rng(1))


def test_it_imports_nothing_of_the_simulator():
    code = "import sys, tests.second_world.record; print('relpos_env' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"


def test_rear_axles_do_not_slide(world, motions):
    for vehicle, motion in zip(world.vehicles, motions, strict=True):
        yaw, rate = motion.yaw(T), motion.yaw(T, 1)
        left = np.stack([-np.sin(yaw), np.cos(yaw)], axis=-1)
        sideways = np.sum(motion.place(T, 1) * left, axis=-1) - vehicle.ahead * rate
        assert np.abs(sideways).max() < 0.02
        assert np.linalg.norm(motion.place(T), axis=1).max() < 2.5 * world.radius


def test_exact_sensors_read_the_motion(world, motions):
    level = replace(world.vehicles[0], tilt=(0.0, 0.0, 0.0))
    none = {"gyr_noise": 0.0, "gyr_bias": 0.0, "acc_noise": 0.0, "acc_bias": 0.0, "vibration": 0.0}
    exact = replace(
        world,
        imu=replace(world.imu, **none),
        field=replace(world.field, bend=0.0, iron=0.0, noise=0.0),
    )
    motion, rng = motions[0], np.random.default_rng(0)
    read = read_imu(exact, level, motion, T, rng)
    yaw = motion.yaw(T)
    forward = np.stack([np.cos(yaw), np.sin(yaw)], axis=-1)
    np.testing.assert_allclose(read[:, 2], motion.yaw(T, 1), atol=1e-9)
    np.testing.assert_allclose(read[:, 3], np.sum(motion.place(T, 2) * forward, axis=1), atol=1e-9)
    np.testing.assert_allclose(read[:, 5], G)
    np.testing.assert_allclose(
        np.arctan2(read[:, 6], read[:, 7]), np.arctan2(np.sin(yaw), np.cos(yaw)), atol=1e-9
    )


def test_ranges_err_as_the_radio_says(world, motions):
    radio = replace(world.radio, white=0.05, slow=0.0)
    rows = read_ranges(replace(world, radio=radio), motions, np.random.default_rng(2))
    t, i, j = rows[:, 0], rows[:, 1].astype(int), rows[:, 2].astype(int)
    assert (np.diff(t) >= 0.0).all()
    true = np.empty(len(t))
    for k in range(len(motions)):
        for m in range(k + 1, len(motions)):
            of = (i == k) & (j == m)
            true[of] = np.linalg.norm(motions[k].place(t[of]) - motions[m].place(t[of]), axis=1)
    error, long = rows[:, 3] - true, rows[:, 4] == 1.0
    assert error[~long].std() == pytest.approx(0.05, rel=0.1)
    assert error[long].min() > 0.2
    assert 0.02 < long.mean() < 0.25


def test_a_seed_is_a_world(world):
    one, two = record(world), record(world)
    np.testing.assert_array_equal(one.block.values, two.block.values)
    assert draw(3) != draw(4)
    n_ranges = int((one.block.kind[0] == Kind.RANGE).sum())
    assert one.nlos is not None
    assert len(one.nlos) == n_ranges


def test_what_is_matched_is_what_was_drawn(world):
    params = matched(world)
    assert params.range_error.white_std == world.radio.white
    assert params.vehicles["car"].sideways_std == 0.005
