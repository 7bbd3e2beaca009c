"""Periodic covariance propagation: ranges in between are applied to the state of the last epoch."""

from dataclasses import replace

import numpy as np

from tracking import Tracker, TrackerParams
from tracking.filters import FilterParams
from tracking.filters.joint.params import JointParams
from tracking.vehicles import VEHICLES


def test_carrying_late_is_carrying_at_once(make_group):
    """Estimates agree except for the process noise of 0.05 s and its later effects."""
    group = make_group(n=4, seconds=12.0, hz=100.0)
    t_out = np.arange(4.0, 12.0, 0.03)
    carriers = {name: replace(c, propagation_period=1e-6) for name, c in VEHICLES.items()}
    often = TrackerParams(filter=FilterParams(joint=JointParams(vehicles=carriers, accuracy=1.0)))
    seldom = TrackerParams(filter=FilterParams(joint=JointParams(accuracy=1.0)))
    at_once = Tracker(group.constellation, often).run(group.block, t_out)
    late = Tracker(group.constellation, seldom).run(group.block, t_out)
    np.testing.assert_array_equal(late.status, at_once.status)
    off = np.linalg.norm(late.pos_ij_w - at_once.pos_ij_w, axis=-1)
    std = np.sqrt(np.trace(at_once.cov[..., :3, :3], axis1=-2, axis2=-1))
    assert np.median(off / std) < 0.05
    assert np.max(off / std) < 0.3
    np.testing.assert_allclose(np.median(late.cov), np.median(at_once.cov), rtol=0.02)
