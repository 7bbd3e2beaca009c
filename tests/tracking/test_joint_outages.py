"""Groups whose tracker begins, or hears nothing for a while, as they drive."""

import numpy as np
import pytest

from agents.simulate import simulate
from tracking import Tracker
from tracking.estimate import Status
from tracking.measurements import Kind, MeasurementBlock
from tracking.orientation import Orientation, OrientationParams

BEGIN, END = 14.0, 26.0
DRIVES = range(200, 216)


@pytest.fixture(scope="module")
def drives():
    """Logs of three cars, and the same with orientations in place of samples."""
    logs = [simulate(scenario="cars-los", seconds=END, seed=seed) for seed in DRIVES]
    stages = [Orientation(log.constellation, OrientationParams()) for log in logs]
    return logs, [stage.step(log.block) for stage, log in zip(stages, logs, strict=True)]


def followed(logs, blocks, t):
    """Estimates of all drives, and their errors in the plane, (drive, time, pair) [m]."""
    group = logs[0].constellation
    found = Tracker(group, n_envs=len(logs)).run(MeasurementBlock.stack(blocks), t)
    truth = np.stack([log.truth.pairs(group, t)[0] for log in logs])
    return found, np.linalg.norm((found.pos_ij_w - truth)[..., :2], axis=-1)


def test_a_tracker_that_begins_in_mid_drive_is_not_sure_of_a_wrong_rotation(drives):
    """Wheels speak against the right one as well while velocities are not known yet."""
    logs, blocks = drives
    t = np.arange(BEGIN, END - 1.0, 0.1)
    found, error = followed(logs, [b.take(b.t[0] > BEGIN) for b in blocks], t)
    wrong = ((found.status == Status.OK) & (error > 1.0)).any(axis=-1)
    assert (wrong.sum(axis=1) > 10).sum() <= 1
    assert (found.status[:, -1] == Status.OK).mean() > 0.8


def test_after_a_silence_the_filter_knows_that_it_knows_less(drives):
    """The first samples after it say nothing about what happened in it."""
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
