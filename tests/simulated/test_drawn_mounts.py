"""Trackers with random mounts on simulated cars: sensors and truth refer to the mount."""

from dataclasses import replace

import numpy as np
import pytest

from agents.simulation.simulate import record
from relpos_env.scenarios import recordable
from relpos_env.scenarios.episode import draw_episode
from relpos_env.scenarios.randomisation import Randomisation
from relpos_env.sensors.imu import ImuSimParams
from tracking.geometry import yaw_of
from tracking.measurements import Kind

DRAWN = Randomisation(mount_ahead=(-0.15, 0.2), mount_aside=(-0.05, 0.05))
STILL = replace(
    ImuSimParams(), gyr_noise=0.0, acc_noise=0.0, gyr_bias=0.0, acc_bias=0.0, gyr_drift=0.0,
    acc_drift=0.0, vibration=0.0, gyr_vibration=0.0,
)  # fmt: skip


@pytest.fixture(scope="module")
def runs():
    """The same drive with trackers at the centres of the cars, and with random mounts."""
    scenario = recordable("cars-los")
    car = replace(scenario.car, roll_compliance=0.0, pitch_compliance=0.0)
    scenario = replace(scenario, imu=STILL, car=car)
    drawn = replace(scenario, randomisation=DRAWN)
    return [record(s, seconds=20.0, seed=4) for s in (scenario, drawn)]


def pose(log, node):
    row = log.truth.node == node
    return log.truth.t[row], log.truth.pos_w[row, :2], np.unwrap(yaw_of(log.truth.q_wb[row]))


def offset(runs, node):
    """Return the offset of the tracker in the body frame of its car, (time, 2) [m]."""
    _, middle, yaw = pose(runs[0], node)
    _, moved, _ = pose(runs[1], node)
    way, c, s = moved - middle, np.cos(yaw), np.sin(yaw)
    return np.stack([c * way[:, 0] + s * way[:, 1], c * way[:, 1] - s * way[:, 0]], axis=-1)


@pytest.mark.parametrize("node", range(3))
def test_a_tracker_stays_where_it_was_drawn(runs, node):
    away = offset(runs, node)
    np.testing.assert_allclose(away, np.broadcast_to(away[0], away.shape), atol=1e-9)
    assert -0.15 <= away[0, 0] <= 0.2
    assert -0.05 <= away[0, 1] <= 0.05
    assert np.linalg.norm(away[0]) > 0.001


@pytest.mark.parametrize("node", range(3))
def test_its_accelerometer_feels_the_way_round_the_middle(runs, node):
    """The additional acceleration of a rigid body at r is ``w x (w x r) + w' x r``."""
    ahead, aside = offset(runs, node)[0]
    read = []
    for log in runs:
        rows = (log.block.kind[0] == Kind.IMU) & (log.block.i[0] == node)
        read.append((log.block.t[0, rows], log.block.values[0, rows]))
    (t, middle), (_, moved) = read
    rate = middle[:, 2]
    spin_up = np.diff(rate, prepend=rate[0]) / np.median(np.diff(t))
    more = moved[:, 3:5] - middle[:, 3:5]
    expected = np.stack(
        [-(rate**2) * ahead - spin_up * aside, spin_up * ahead - rate**2 * aside], axis=-1
    )
    # A yaw rate rounded to 0.001 rad/s determines its derivative to 0.1 rad/s2.
    assert np.abs(more - expected).max() < 0.03
    assert np.abs(expected).max() > 0.3
    np.testing.assert_array_equal(moved[:, :3], middle[:, :3])


def test_without_randomisation_it_is_in_the_middle():
    episode = draw_episode(recordable("cars-los"), 3, 10.0, np.random.default_rng(0))
    np.testing.assert_array_equal(episode.mounts, 0.0)


def test_antennas_at_drawn_heights_measure_the_slant():
    """Ranges are longer between different heights; equal heights change them by the roll only."""
    ranges = []
    for heights in ((0.0, 0.0), (0.8, 0.8), (0.0, 0.8)):
        drawn = Randomisation(mount_height=heights)
        log = record(replace(recordable("cars-los"), randomisation=drawn), seconds=20.0, seed=4)
        ranges.append(log.block.values[0, log.block.kind[0] == Kind.RANGE, 0])
    level, raised, apart = ranges
    assert abs(np.mean(raised - level)) < 0.01
    assert np.mean(apart - level) > 0.015
