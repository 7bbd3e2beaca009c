"""Nodes that glide: an IMU at a constant velocity reads what it reads at rest."""

from dataclasses import replace

import numpy as np
import pytest

from tests.exact_motion import GLIDE, Gliders
from tracking import Tracker, TrackerParams
from tracking.filters import FilterParams
from tracking.filters.joint.params import JointParams
from tracking.measurements import Kind
from tracking.metrics.score import score

T = np.arange(2.0, 21.5, 0.1)


def errors(vehicle, glide_nis):
    """Return rmse_yaw while two nodes glide [m], and the share that is ok and off by 0.5 m."""
    group, rng = Gliders(vehicle, range(3), hz=50.0, seconds=22.0), np.random.default_rng(1)
    values, ranges = group.block.values.copy(), group.block.kind[0] == Kind.RANGE
    values[0, ranges, 0] += 0.05 * rng.standard_normal(ranges.sum())
    joint = JointParams()
    joint = replace(joint, update=replace(joint.update, glide_nis=glide_nis))
    tracker = Tracker(group.constellation, TrackerParams(filter=FilterParams(joint=joint)))
    estimate = tracker.run(replace(group.block, values=values), T).take(0)
    truth = group.pairs(T)
    found = score(estimate, truth, np.ones(truth.shape[:2], dtype=bool), GLIDE + 0.5)
    wrong = estimate.ok & (np.linalg.norm(estimate.pos_ij_w - truth, axis=-1) > 0.5)
    return found.rmse_yaw, wrong.mean()


@pytest.mark.parametrize("vehicle", ["robot", "human"])
def test_a_node_that_glides_is_not_held_for_one_at_rest(vehicle):
    rmse, wrong = errors(vehicle, JointParams().update.glide_nis)
    assert rmse < 0.2
    assert wrong < 0.01
    rmse, wrong = errors(vehicle, 1e9)
    assert rmse > 1.0
    assert wrong > 0.05
