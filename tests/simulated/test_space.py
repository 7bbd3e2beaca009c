"""Tracking in space from raw sensors: hands next to fixed nodes, and drones."""

import runpy
import sys
from pathlib import Path

import numpy as np
import pytest

from tracking import Constellation, NodeConfig, Tracker
from tracking.ahrs.orientation import Orientation
from tracking.ahrs.params import OrientationParams
from tracking.geometry import rotate
from tracking.measurements import Kind, MeasurementBlock

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.fixture(scope="module")
def measured():
    """Names of the benchmark script, with its simulated runs."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "path", [str(BENCHMARKS), *sys.path])
        return runpy.run_path(str(BENCHMARKS / "measure_space.py"))


@pytest.mark.parametrize("seed", [9, 11, 12, 13])
def test_a_hand_is_followed_among_fixed_nodes(measured, seed):
    """Seed 9 tests that surveyed distances reject joining nodes on the wrong side."""
    judged = measured["judge"](measured["hand"](seed), seed)
    assert judged.settled_shape < 0.4
    assert judged.ok > 0.5
    assert judged.ok_but_wrong < 0.25


@pytest.mark.parametrize("seed", [5, 6, 9, 13])
def test_a_swarm_of_drones_keeps_together(measured, seed):
    judged = measured["judge"](measured["drones"](seed), seed)
    assert judged.settled_shape < 0.25
    assert judged.settled_yaw < 0.45
    assert judged.first_ok < 12.0


def test_the_tilt_of_a_drone_that_was_in_flight_at_the_start_does_not_swing():
    """The gyro bias must not adapt to the tilt faster than the tilt is corrected."""
    space = runpy.run_path(str(BENCHMARKS / "space_runs.py"))
    rng, t = np.random.default_rng(4), np.arange(0.0, 60.0, 0.01)
    nodes = (NodeConfig(id=1, vehicle="drone", initial_heading=0.0), NodeConfig(id=2))
    constellation = Constellation(nodes=nodes, heading="initial")
    worst = []
    while len(worst) < 6:
        mover = space["make_mover"](rng, flies=True)
        if mover.rest > 0.0:
            continue
        imu = mover.imu(t, space["GOOD"], rng)
        block = MeasurementBlock.of_kind(Kind.IMU, t, np.zeros(len(t), dtype=np.int64), imu)
        stage = Orientation(constellation, OrientationParams(), follows_bias=True)
        q = stage.step(block).values[0, 2000:, :4]
        up = rotate(q, mover.turns(t[2000:]).inv().apply([0.0, 0.0, 1.0]))
        worst.append(np.degrees(np.arccos(up[:, 2])).max())
    assert max(worst) < 6.0
    assert np.median(worst) < 4.0


def test_surveyed_distances_settle_on_which_side_fixed_nodes_are(measured):
    """Eight fixed nodes join in sequence; one layout remains before the first range."""
    run = measured["hand"](9)
    tracker, t = Tracker(run.constellation), run.block.t[0]
    tracker.step(run.block.take(slice(0, int(np.searchsorted(t, 2.0)))), 2.0)
    state = tracker.save()["filter"]
    best, truth = int(state.group["best"][0, 0]), run.positions(np.array([2.0]))[0, 1:]
    found = np.stack([state.x[0, best, at : at + 3] for at in state.nodes["i_pos"][0, 1:]])
    for places in (found, truth):
        places -= places.mean(axis=0)
    u, _, v = np.linalg.svd(truth.T @ found)
    assert np.linalg.norm(found @ (u @ v).T - truth, axis=1).max() < 0.15
