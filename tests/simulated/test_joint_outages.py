"""Trackers that start, or receive nothing for some time, while the group drives."""

from dataclasses import replace

import numpy as np
import pytest

from agents.evaluation.track import track_log
from agents.simulation.simulate import simulate
from tracking import Tracker
from tracking.ahrs.orientation import Orientation
from tracking.ahrs.params import OrientationParams
from tracking.estimate import Status
from tracking.findings import find_unused
from tracking.measurements import Kind, MeasurementBlock

BEGIN, END = 14.0, 26.0
DRIVES = range(200, 216)


@pytest.fixture(scope="module")
def drives():
    """Logs of three cars, and blocks with orientations instead of inertial samples."""
    logs = [simulate(scenario="cars-los", seconds=END, seed=seed) for seed in DRIVES]
    stages = [Orientation(log.constellation, OrientationParams()) for log in logs]
    return logs, [stage.step(log.block) for stage, log in zip(stages, logs, strict=True)]


def followed(logs, blocks, t):
    """Return estimates of all drives and horizontal errors, (drive, time, pair) [m]."""
    group = logs[0].constellation
    found = Tracker(group, n_envs=len(logs)).run(MeasurementBlock.stack(blocks), t)
    truth = np.stack([log.truth.pairs(group, t)[0] for log in logs])
    return found, np.linalg.norm((found.pos_ij_w - truth)[..., :2], axis=-1)


def test_a_tracker_that_begins_in_mid_drive_is_not_sure_of_a_wrong_rotation(drives):
    """Wheel constraints contradict the true rotation too, until velocities are known."""
    logs, blocks = drives
    t = np.arange(BEGIN, END - 1.0, 0.1)
    found, error = followed(logs, [b.take(b.t[0] > BEGIN) for b in blocks], t)
    wrong = ((found.status == Status.OK) & (error > 1.0)).any(axis=-1)
    assert (wrong.sum(axis=1) > 10).sum() <= 1
    assert (found.status[:, -1] == Status.OK).mean() > 0.8


def test_after_a_silence_the_filter_knows_that_it_knows_less(drives):
    """The first samples after a gap carry no information about the motion during the gap."""
    logs, blocks = drives
    gap, group = 0.5, logs[0].constellation
    cut = [b.take((b.t[0] <= BEGIN) | (b.t[0] > BEGIN + gap)) for b in blocks]
    stds = []
    for block in cut:
        tracker, before = Tracker(group), block.t[0] <= BEGIN
        tracker.step(block.take(before), BEGIN)
        later = block.take(~before)
        first = float(later.t[0, 0])
        states = (later.t[0] == first) & (later.kind[0] == Kind.STATE)
        silent = tracker.step(MeasurementBlock.empty(), first)
        after = tracker.step(later.take(states), first)
        stds.append([np.sqrt(np.trace(e.cov[0, :, :2, :2], axis1=-2, axis2=-1).max())
                     for e in (silent, after)])  # fmt: skip
    silent, after = np.array(stds).T
    np.testing.assert_allclose(after, silent, rtol=0.05)
    found, error = followed(logs, cut, np.array([BEGIN + gap + 2.0]))
    assert np.sqrt(np.mean(error**2)) < 0.25


def wrong_and_ok(logs, cut, since):
    """Return the number of drives with a pair ok and wrong by > 1 m for > 0.5 s in total."""
    found, error = followed(logs, cut, np.arange(since, END - 0.5, 0.1))
    wrong = ((found.status == Status.OK) & (error > 1.0)).any(axis=-1)
    return (wrong.sum(axis=1) > 5).sum(), found, error


def test_a_group_that_heard_nothing_for_seconds_begins_anew(drives):
    """The cars moved apart: a filter without reset would end up reflected or rotated."""
    logs, blocks = drives
    back = BEGIN + 2.0
    cut = [b.take((b.t[0] <= BEGIN) | (b.t[0] > back)) for b in blocks]
    n_wrong, found, error = wrong_and_ok(logs, cut, back)
    assert n_wrong <= 1
    assert not (found.status[:, 3] == Status.OK).any()
    assert (found.status[:, -1] == Status.OK).mean() > 0.8
    assert np.median(error[:, -1]) < 0.15


def test_a_car_that_was_not_heard_for_seconds_joins_anew(drives):
    """The others are not affected, and the car joins again within 2 s."""
    logs, blocks = drives
    back = BEGIN + 3.0
    cut = []
    for b in blocks:
        its = (b.i[0] == 0) | ((b.kind[0] == Kind.RANGE) & (b.j[0] == 0))
        cut.append(b.take((b.t[0] <= BEGIN) | (b.t[0] > back) | ~its))
    n_wrong, _, error = wrong_and_ok(logs, cut, back)
    assert n_wrong <= 1
    its_pairs = [0 in pair for pair in logs[0].constellation.pairs]
    assert np.median(error[:, 20][:, its_pairs]) < 0.2
    assert np.sqrt(np.mean(error[:, :, np.logical_not(its_pairs)] ** 2)) < 0.25


def test_ranges_alone_that_are_missed_are_bridged_by_inertia(drives):
    logs, blocks = drives
    back = BEGIN + 2.0
    kept = [(b.kind[0] != Kind.RANGE) | (b.t[0] <= BEGIN) | (b.t[0] > back) for b in blocks]
    cut = [b.take(k) for b, k in zip(blocks, kept, strict=True)]
    found, error = followed(logs, cut, np.array([back + 0.5, back + 1.0]))
    assert (found.status[:, 1] == Status.OK).mean() > 0.8
    assert np.median(error[:, 0]) < 0.25


def test_those_who_come_back_begin_anew_without_those_who_do_not(make_group):
    """Two of five nodes stay silent: the start does not wait for them."""
    group = make_group(n=5, seconds=13.0)
    b = group.block
    ranges = b.kind[0] == Kind.RANGE
    away = (b.i[0] >= 3) | (ranges & (b.j[0] >= 3))
    block = b.take((b.t[0] <= 8.0) | ((b.t[0] > 10.0) & ~away))
    status = Tracker(group.constellation).run(block, np.array([7.9, 10.6, 12.0])).status[0]
    index = group.constellation.pair_index
    back = [index[0, 1], index[0, 2], index[1, 2]]
    assert (status[0] == Status.OK).all()
    assert np.isin(status[1:, back], (Status.AMBIGUOUS, Status.OK)).all()
    assert (status[1:, index[3, 4]] == Status.ABSENT).all()


@pytest.mark.parametrize("n", [2, 3])
def test_who_stands_is_where_it_was(make_group, n):
    """At rest, distances are known and the rotation is not: a gap in the ranges removes no node."""

    class Standing(make_group):
        def pos(self, t):
            angle = 2.0 * np.pi * np.arange(len(self.rate)) / len(self.rate) + 0.3
            pos = np.zeros((*np.shape(t), len(self.rate), 3))
            pos[..., 0], pos[..., 1] = 5.0 * np.cos(angle), 5.0 * np.sin(angle)
            return pos

    group = Standing(n=n, seconds=7.0)
    b = group.block
    its = (b.kind[0] == Kind.RANGE) & ((b.i[0] == 0) | (b.j[0] == 0))
    block = b.take(~(its & (b.t[0] > 5.0) & (b.t[0] < 5.6)))
    status = Tracker(group.constellation).run(block, np.array([4.9, 5.65, 5.8, 6.5])).status[0]
    assert not np.isin(status, (Status.ABSENT, Status.STARTING)).any()


def test_a_look_ahead_past_a_silence_keeps_the_past(make_group):
    group = make_group(n=3, seconds=12.0)
    b, now = group.block, 9.55
    block = b.take((b.t[0] <= 8.0) | (b.t[0] > 9.6))
    tracker = Tracker(group.constellation)
    before = tracker.step(block.take(block.t[0] <= now), now)
    later = block.take((block.t[0] > now) & (block.t[0] <= now + 0.5))
    smoothed = tracker.smooth(later, now)
    assert np.linalg.norm(before.pos_ij_w[0], axis=-1).min() > 0.1
    assert np.linalg.norm(smoothed.pos_ij_w[0], axis=-1).min() > 0.1


def without_imu(log, node, after):
    block = log.block
    rows = (block.i[0] == node) & np.isin(block.kind[0], (Kind.IMU, Kind.MAG))
    return replace(log, block=block.take(~rows | (block.t[0] <= after)))


@pytest.mark.parametrize("after", [-1.0, 20.0])
@pytest.mark.parametrize("seed", [13, 20])
def test_of_three_cars_one_without_an_imu_may_be_on_either_side(seed, after):
    """Its layout is right but for reflection, so it is ambiguous, not ok."""
    log = without_imu(simulate(scenario="cars-los", seconds=40.0, seed=seed), 1, after)
    (found,) = find_unused(log)
    assert (found.name, found.nodes) == ("no-imu", (log.constellation.ids[1],))
    result = track_log(log, findings=[])
    late = result.estimate.status[result.estimate.t > max(after, 0.0) + 3.0]
    i, j = log.constellation.pairs.T
    assert (late[:, (i == 1) | (j == 1)] == Status.AMBIGUOUS).mean() > 0.95
    assert result.score.integrity_share < 0.003
    assert result.score.rmse_mirror < 0.15


def test_of_four_cars_one_without_an_imu_is_found_by_the_others():
    log = simulate(scenario="hall", cars=4, seconds=30.0, seed=4)
    result = track_log(without_imu(log, 1, -1.0), findings=[])
    assert result.score.ok_share > 0.6
    assert result.score.integrity_share < 0.01
    assert result.score.rmse_yaw < 0.25
