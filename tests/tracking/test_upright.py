"""Tilt corrections of an orientation: reported, and removed from the acceleration."""

from dataclasses import replace

import numpy as np

from tracking import Constellation, NodeConfig, Tracker, TrackerParams
from tracking.ahrs.orientation import Orientation
from tracking.ahrs.params import OrientationParams
from tracking.filters import FilterParams
from tracking.filters.joint.params import JointParams
from tracking.geometry import GRAVITY
from tracking.measurements import (
    AHRS_STATUS,
    GYRO_VAR,
    N_VALUES,
    UPRIGHT,
    Kind,
    MeasurementBlock,
)
from tracking.vehicles import VEHICLES

FIXED = np.array([[-2.0, -2.0, 0.2], [2.0, -1.5, 2.0], [1.5, 2.0, 0.4], [-1.8, 1.7, 1.9]])


def test_what_is_read_changes_by_what_was_turned_upright():
    """A lasting force is corrected as a tilt; acceleration and correction keep their sum."""
    n = 1500
    t = np.arange(1, n + 1) / 100.0
    force = np.array([0.1, -0.06, GRAVITY])
    imu = np.zeros((n, 6))
    imu[:, 3:] = np.where(t[:, None] < 2.0, [0.0, 0.0, GRAVITY], force)
    imu += 1e-4 * np.random.default_rng(0).standard_normal(imu.shape)
    nodes = (
        NodeConfig(id=1, vehicle="hand", initial_heading=0.7),
        NodeConfig(id=2, kind="static"),
    )
    stage = Orientation(Constellation(nodes=nodes, heading="initial"), OrientationParams())
    block = MeasurementBlock.of_kind(Kind.IMU, t, np.zeros(n, dtype=np.int64), imu)
    out = stage.step(block).values[0]
    assert np.isin(out[:, AHRS_STATUS], (1.0, 2.0)).all()
    assert (out[t > 1.9, AHRS_STATUS][0], out[0, AHRS_STATUS]) == (2.0, 1.0)  # at rest
    assert (out[:, GYRO_VAR] > 0.0).all()
    assert out[-1, GYRO_VAR] < 0.1 * out[0, GYRO_VAR]
    accel, (x, y) = out[:, 4:6], out[:, UPRIGHT : UPRIGHT + 2].T
    moved = accel[t > 2.5] - GRAVITY * np.stack([y, -x], axis=1)[t > 2.5]
    turn = np.array([[np.cos(0.7), -np.sin(0.7)], [np.sin(0.7), np.cos(0.7)]])
    assert np.abs(accel[-1]).max() < 0.2 * np.abs(turn @ force[:2]).max()  # corrected by now
    np.testing.assert_allclose(moved, np.tile(turn @ force[:2], (len(moved), 1)), atol=2e-3)


def walk(upright, told, lean=0.0, seconds=12.0, seed=0):
    """Track a hand whose acceleration errs by a varying tilt; return positions and tracker.

    Positions are (time, pair, 3). The tilt rate `lean` [rad/s] is reported by its variance only.
    """
    rng = np.random.default_rng(seed)
    nodes = (
        NodeConfig(id=0, vehicle="hand", initial_heading=0.0),
        *(NodeConfig(id=k + 1, kind="static") for k in range(len(FIXED))),
    )
    carriers = {**VEHICLES, "hand": replace(VEHICLES["hand"], bias_tau_with_ahrs_feedback=1e9)}
    params = TrackerParams(filter=FilterParams(joint=JointParams(vehicles=carriers)))
    tracker = Tracker(Constellation(nodes=nodes, heading="initial", dimensions=3), params)
    t = np.arange(0.0, seconds, 0.01)
    angle = np.array([0.7, 1.1, 1.6])
    place = np.array([1.0, 0.8, 0.4]) * np.sin(angle * t[:, None]) + [0.0, 0.0, 1.0]
    accel = -np.array([1.0, 0.8, 0.4]) * angle**2 * np.sin(angle * t[:, None])
    values = np.zeros((len(t), N_VALUES))
    values[:, 0], values[:, 4:7] = 1.0, accel
    tilt = upright * np.stack([np.sin(0.5 * t), np.cos(0.3 * t) - 1.0], axis=1)
    force = accel + [0.0, 0.0, GRAVITY]
    leans = tilt + np.stack([lean * t, 0.5 * lean * t], axis=1)
    values[:, 4:7] += np.cross(np.pad(leans, ((0, 0), (0, 1))), force)
    if told:
        values[:, AHRS_STATUS], values[:, UPRIGHT : UPRIGHT + 2] = 1.0, tilt
        values[:, GYRO_VAR] = 1e-4 if lean else 1e-8
    other = np.arange(len(t)) % len(FIXED)
    z = np.linalg.norm(FIXED[other] - place, axis=1) + rng.normal(0.0, 0.03, len(t))
    i, j = np.triu_indices(len(FIXED), 1)
    surveyed = np.linalg.norm(FIXED[i] - FIXED[j], axis=1)
    zeros = np.zeros(len(t), dtype=np.int64)
    block = MeasurementBlock.concatenate([
        MeasurementBlock.of_kind(Kind.STATE, t, zeros, values),
        MeasurementBlock.of_kind(Kind.SURVEY, np.zeros(len(i)), i + 1, surveyed[:, None], j=j + 1),
        MeasurementBlock.of_kind(Kind.RANGE, t + 0.005, zeros, z[:, None], j=other + 1),
    ]).sorted()  # fmt: skip
    return tracker.run(block, np.arange(1.0, seconds, 0.5)[None]).pos_ij_w[0], tracker


def test_a_tilt_that_changes_as_it_is_told_changes_little():
    """The rest is due to preintegration: a correction counts from the next interval on."""
    small, known = 1e-5, slice(6, None)
    told, untold = (
        np.abs(walk(small, told)[0][known] - walk(0.0, told)[0][known]).max() / small
        for told in (True, False)
    )
    assert untold > 5.0  # [m/rad]
    assert told < 0.15 * untold
